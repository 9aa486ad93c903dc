"""Ensembles of structural dynamics, integrated in parallel on GPUs and CPUs.

The public names stand in `__init__.pyi`, with the modules that they come from. Each module is imported when one of its
names is first asked for (PEP 562), so that `import warpdyn` is quick and imports no warp.
"""

import lazy_loader

__version__ = "0.1.0"  # the one place: pyproject.toml reads it from here

_named, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    """Return a public name; near misses are answered with the name that was meant."""
    if name in __all__ or name.startswith("_"):
        return _named(name)
    from warpdyn.core.near_misses import did_you_mean

    raise AttributeError(f"warpdyn has no {name!r}{did_you_mean(name, __all__)}")
