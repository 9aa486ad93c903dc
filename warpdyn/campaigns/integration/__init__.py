"""From a scene to kernel launches: sampling, equations of motion, packing, time grids, the stability guard."""
