"""From a scene to launches: sampling, damping, packing, time grids, the stability guard."""
