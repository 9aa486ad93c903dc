"""Versions of packages: warpdyn's own stands in the package itself, so that a checkout needs no installation."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

from warpdyn import __version__


def version_of(package: str) -> str | None:
    """Return the version of a package, or None if it is not installed.

    Args:
        package: Name of the distribution, such as "warp-lang".
    """
    if package == "warpdyn":  # of what runs, whatever is installed beside it
        return __version__
    try:
        return version(package)
    except PackageNotFoundError:
        return None
