"""Recorder of the numbers of accepted and rejected steps of an adaptive method, in every run of such a method."""

from warpdyn.engine.methods.table import METHODS
from warpdyn.foundations.core.output_variables import Variable

order = 70
ADAPTIVE = {
    "accepted_steps": Variable((), "1", "integration steps taken", is_whole=True),
    "rejected_steps": Variable((), "1", "integration steps tried and found too long", is_whole=True),
}

BORROWS = {"adaptivity": ("accepted", "rejected")}


def wanted(plan):
    return METHODS[plan.method].is_adaptive and "history" not in plan.recorders


def write():
    output.accepted_steps[o] = accepted[j]
    output.rejected_steps[o] = rejected[j]
