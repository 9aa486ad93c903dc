"""The model of a run: structures, ground motions, scenes, inventories of buildings and sites."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submodules=["control", "inventories", "sites"])
