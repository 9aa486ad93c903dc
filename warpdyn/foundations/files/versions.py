"""Versions of packages. The version of warpdyn is in its code, so that it is also known without installation."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError, version

from warpdyn import __version__


@cache
def version_of(package: str) -> str | None:
    """Return the version of an installed package, such as "warp-lang"; None if the package is not installed."""
    if package == "warpdyn":  # the version of the running code, which may differ from the installed version
        return __version__
    try:
        return version(package)
    except PackageNotFoundError:
        return None
