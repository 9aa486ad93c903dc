"""Copies of the limits of hinges' lines in the local memory of a GPU's thread, for the loop over hinges that left them.

The arrays of a thread are in registers if all indices are known at compile time; the indices of this loop are not.
"""

order = 4


def wanted(plan):
    return plan.frame_storeys is not None and plan.sections > 1


def values_held(plan):
    return 0


def declare():
    copied_rotation = end_rows()
    copied_least_rotation = end_rows()
    copied_most_rotation = end_rows()
    copied_side = end_rows()
