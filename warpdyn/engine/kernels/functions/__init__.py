"""Device functions of history kernels: adaptive steps, random motions, energies, recording."""
