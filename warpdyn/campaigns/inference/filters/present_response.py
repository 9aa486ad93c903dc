"""Recorder of the present floor accelerations and storey forces, which filters compare with measurements.

The class is defined when a filter needs it, because its definition registers the recorder.
"""
# mypy: ignore-errors
# ruff: noqa: F821, F841, RUF012

from __future__ import annotations


def present_response() -> str:
    """Define the recorder if it is not defined yet, and return its name."""
    from warpdyn.engine.kernels.composing.user_recorders import USERS, Recorder
    from warpdyn.foundations.core.output_variables import Variable

    if "present_response" in USERS:
        return "present_response"

    class PresentResponse(Recorder):
        """Absolute acceleration of each floor and force of each storey at the last state of the run."""

        VARIABLES = {
            "chain": {
                "present_acceleration": Variable(("floor",), "m s-2", "absolute acceleration at the last state"),
                "present_storey_force": Variable(("storey",), "N", "storey force at the last state"),
            }
        }

        def declare():
            last_acceleration = matrix()
            last_force = matrix()

        def see_forces():
            last_acceleration[i, j] = ai
            last_force[i, j] = restoring

        def finish_storey():
            output.present_acceleration[g, o] = last_acceleration[i, j]
            output.present_storey_force[g, o] = last_force[i, j]

    return "present_response"
