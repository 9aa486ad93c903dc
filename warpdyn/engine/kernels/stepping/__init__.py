"""Parts of kernels that belong to methods: slopes of stages, implicit systems, adaptive steps."""
