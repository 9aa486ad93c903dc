"""Functions that history kernels call: adaptive steps, random motions, energies, recording."""
