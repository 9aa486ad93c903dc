"""Ensembles of structural dynamics, integrated in parallel on GPUs and CPUs.

The public names stand in `__init__.pyi`, with the modules that they come from. Each module is imported when one of its
names is first asked for (PEP 562), so that `import warpdyn` is quick and imports no warp.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
