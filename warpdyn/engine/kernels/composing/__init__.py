"""Check the parts of a kernel, and write the source of the kernel from a skeleton (time loop) and its parts."""
