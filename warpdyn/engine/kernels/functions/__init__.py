"""Device functions that kernels of response histories call: adaptive steps, random motions, energies, recording."""
