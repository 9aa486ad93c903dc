"""Dashpots parallel to the springs of a lumped structure: their own ones and those in proportion to the stiffness."""


def wanted(plan):
    return plan.pattern is not None and plan.pattern.has_dashpots


def add_to_dashpot():
    dashpot = terms[FIRST_DASHPOT + i, j] * rate
