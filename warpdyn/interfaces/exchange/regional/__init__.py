"""Results of each building of a region in files for GIS programs, SimCenter's R2D tool and OpenQuake."""
