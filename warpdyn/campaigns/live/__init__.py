"""Live ensembles: histories that advance while the ground motion arrives, packet by packet."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submodules=["packets"])
