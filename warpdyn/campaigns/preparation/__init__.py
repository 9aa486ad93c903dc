"""Preparation of structures and samples by kernels on the device that integrates them."""
