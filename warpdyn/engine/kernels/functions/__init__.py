"""Device functions that kernels of histories call: adaptive steps, random motions, energies, what is kept."""
