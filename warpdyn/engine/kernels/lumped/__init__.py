"""Parts of kernels of lumped structures, whose degrees of freedom, springs and outputs are separate."""
