"""The base class of biaxial laws."""

from __future__ import annotations

from warpdyn.engine.laws.definition import BIAXIAL_LAWS
from warpdyn.engine.laws.law import StoreyElement


class BiaxialLaw(StoreyElement):
    """Base class of biaxial laws: the two forces of a `BiaxialSpring` depend on both deformations and a common state.

    Raises:
        ValueError: If a parameter of an object of a subclass is out of its bounds.
        TypeError: If the definition of a subclass breaks a rule.

    Example:
        >>> law = wd.laws.CircularYield(yield_force=2e5, post_yield_stiffness=1e6)
        >>> isinstance(law, wd.laws.BiaxialLaw)
        True
    """

    table = BIAXIAL_LAWS
    kind = "biaxial law"


StoreyElement.kinds = (*StoreyElement.kinds, BiaxialLaw)
