"""Wider bounds of checks for laws of warpdyn, with the reasons."""

from __future__ import annotations

DAMAGE = "damage and unloading stiffness change with the path, and so does the energy that unloading would return"
TURN = "the energy that unloading would return depends on rules that are decided at the next reversal"
ENERGY = "dissipated energy, by which damage grows, is summed over steps"
CROSSING = "the unloading rule is decided in the step in which the force changes its sign"
PATH = "damage and overlapping corners change the path of unloading, and so does the energy that unloading would return"
REST = "a step through zero force towards a side without stiffness keeps some force, which decreases with the step"
STRENGTH = "where a reversal removes most of the strength, elastic energy that was stored before is returned"
DROP = "known defect: with strong hardening, a reversal during unloading drops the force by up to 0.6 % of the largest"
COLLAPSED = "a storey that loses its strength amplifies the error of the step in which a branch begins"

#: From the name of a law to its checks, each with the wider bound and the reason.
EXCEPTIONS: dict[str, dict[str, tuple[float, str]]] = {
    "baber_noori": {"dissipation": (500.0, DAMAGE)},
    "hysteretic": {"dissipation": (0.05, REST), "step independence": (0.05, ENERGY)},
    "ibarra_medina_krawinkler_bilinear": {"dissipation": (5.0, DAMAGE), "step independence": (0.01, ENERGY)},
    "ibarra_medina_krawinkler_peak_oriented": {"dissipation": (5.0, DAMAGE), "step independence": (0.01, ENERGY)},
    "ibarra_medina_krawinkler_pinching": {
        "dissipation": (5.0, DAMAGE),
        "step independence": (0.01, ENERGY),
        "convergence order of rk4": (0.3, COLLAPSED),
    },
    "menegotto_pinto": {"dissipation": (0.2, TURN)},
    "takeda": {
        "continuity of the force": (2.0, DROP),
        "dissipation": (0.2, TURN),
        "step independence": (0.01, CROSSING),
    },
    "pinching4": {
        "dissipation": (10.0, PATH),
        "step independence": (0.01, ENERGY),
        "passivity": (0.2, STRENGTH),
    },
}
