"""The kernels: devices, integration methods, storey laws, and the composition and compilation of kernels."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submodules=["kernels", "laws"])
