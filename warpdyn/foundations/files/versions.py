"""Versions of packages. The version of warpdyn is in its code, so that it is known without installation."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError, version

from warpdyn import __version__


@cache
def version_of(package: str) -> str | None:
    """Return the version of a distribution, such as "warp-lang", or None if it is not installed."""
    if package == "warpdyn":  # of the running code, even if another version is installed
        return __version__
    try:
        return version(package)
    except PackageNotFoundError:
        return None
