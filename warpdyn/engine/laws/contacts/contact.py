"""The base class of contacts."""

from __future__ import annotations

from warpdyn.engine.laws.definition import CONTACTS
from warpdyn.engine.laws.law import StoreyElement, Values


class Contact(StoreyElement):
    """Base class of contacts: laws of springs of a lumped structure whose force may depend on the rate of deformation.

    Raises:
        ValueError: If a parameter of an object of a subclass is out of its bounds.
        TypeError: If the definition of a subclass breaks a rule.

    Example:
        >>> isinstance(wd.laws.HertzContact(clearance=0.02, hertz_stiffness=2.75e9), wd.laws.Contact)
        True
    """

    table = CONTACTS
    kind, is_device = "contact", True

    @classmethod
    def is_sensitive(cls, p: Values) -> bool:
        """Return True: a small change of the time of contact changes the rebound."""
        return True


StoreyElement.kinds = (*StoreyElement.kinds, Contact)
