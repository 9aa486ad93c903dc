"""Writers of the results of each building of a region, for GIS programs, SimCenter's R2D tool and OpenQuake."""
