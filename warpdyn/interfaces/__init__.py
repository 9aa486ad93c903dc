"""Figures and reports of runs, and readers and writers for files of other programs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submodules=["hybrid", "plots"])
