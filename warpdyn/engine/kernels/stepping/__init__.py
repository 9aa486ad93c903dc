"""Parts of kernels that integrate the motion in a step: slopes of stages, implicit systems, adaptive steps."""
