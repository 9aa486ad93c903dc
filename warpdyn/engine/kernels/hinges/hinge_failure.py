"""Hinges that have lost their strength: the member then turns freely, so the recorder of such a hinge stops."""

from warpdyn.engine.kernels.hinges.column_storeys import has_line

order = 4


def wanted(plan):
    return has_line(plan) and "spring" in plan.recorders and "ibarra_medina_krawinkler" in str(plan.law)


def values_held(plan):
    return plan.springs_of_thread


def declare():
    is_sound = spring_rows()  # 1; 0 after the strength of a hinge was lost


def read_spring_row():
    is_sound[i, j] = dtype(1.0)
