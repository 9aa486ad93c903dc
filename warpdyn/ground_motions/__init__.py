"""Ground motions: records and their readers, random motions, intensity measures, spectra, designs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submodules=["records"])
