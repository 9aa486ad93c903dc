"""Hybrid tests: a computed structure and an external substructure exchange displacements and forces over a socket."""

from __future__ import annotations

from warpdyn.interfaces.hybrid.hybrid_test import HybridTest, HybridTestError
from warpdyn.interfaces.hybrid.substructure import Substructure

__all__ = ["HybridTest", "HybridTestError", "Substructure"]
