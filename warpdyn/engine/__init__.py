"""Storey laws, integration methods, and the composition, compilation and launch of kernels."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submodules=["kernels", "laws"])
