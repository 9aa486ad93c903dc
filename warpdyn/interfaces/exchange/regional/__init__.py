"""Results of each building of a region, in the files that GIS programs, SimCenter's R2D and OpenQuake's users read."""
