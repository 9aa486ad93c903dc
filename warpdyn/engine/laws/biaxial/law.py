"""The base class of biaxial laws."""

from __future__ import annotations

from warpdyn.engine.laws.definition import BIAXIAL_LAWS
from warpdyn.engine.laws.law import StoreyElement


class BiaxialLaw(StoreyElement):
    """Base class of biaxial laws: the two forces of a `BiaxialSpring` depend on both deformations and a common state.

    Example:
        >>> law = wd.laws.CircularYield(yield_force=2e5, post_yield_stiffness=1e6)
        >>> isinstance(law, wd.laws.BiaxialLaw)
        True
    """

    table = BIAXIAL_LAWS
    kind = "biaxial law"


StoreyElement.kinds = (*StoreyElement.kinds, BiaxialLaw)
