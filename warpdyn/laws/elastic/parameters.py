"""Linear storeys."""

from __future__ import annotations

from warpdyn.laws.law import Law

LAWS = {"elastic": Law()}
