"""Ground motions: readers of records, random motions, intensity measures, response spectra, excitations of scenes."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submodules=["records"])
