"""Parts of kernels for kinds of viscous damping."""
