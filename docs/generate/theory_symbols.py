"""Symbols of the parameters of storey laws and devices in the theory manual, in LaTeX."""

from __future__ import annotations

from collections.abc import Mapping

from warpdyn.engine.laws import StoreyElement

_NEGATIVE = "_negative"
# Symbols by the name of the parameter; parameters of the negative side have the symbol with a minus sign above.
SYMBOLS = {
    "bearing_drift": "u_b",
    "bearing_stiffness_ratio": "r_b",
    "beta": r"\beta",
    "brace_stiffness": "k_b",
    "capping_force_ratio": "r_c",
    "clearance": "g_0",
    "contact_stiffness": "k_c",
    "counts_cycles": "s",
    "cracked_stiffness_ratio": r"\alpha_c",
    "cracking_ratio": "r_{cr}",
    "curvature_reduction": "c_{R1}",
    "curvature_reduction_ductility": "c_{R2}",
    "damage_by_ductility": "d_1",
    "damage_by_energy": "d_2",
    "damper_coefficient": r"c_\alpha",
    "deterioration_exponent": "c",
    "deterioration_rate": "D",
    "drift_at_peak_force": "D_U",
    "ductility_2": r"\mu_2",
    "ductility_3": r"\mu_3",
    "ductility_4": r"\mu_4",
    "energy_factor": r"\gamma_E",
    "exponent": "n",
    "flag_height": r"\beta_f",
    "force_ratio_2": "r_2",
    "force_ratio_3": "r_3",
    "force_ratio_4": "r_4",
    "friction_coefficient": r"\mu_f",
    "gamma": r"\gamma",
    "growth_loss": r"\delta_A",
    "hardening_ratio": r"\alpha",
    "isotropic_hardening": "a_1",
    "isotropic_hardening_ductility": "a_2",
    "linear_velocity": "v_0",
    "pinching_coupling": r"\lambda",
    "pinching_drift": "p_x",
    "pinching_drift_ratio": r"\kappa_D",
    "pinching_force": "p_y",
    "pinching_force_ratio": r"\kappa_F",
    "pinching_level": "q",
    "pinching_rate": "p",
    "pinching_spread": r"\psi",
    "pinching_spread_rate": r"\delta_\psi",
    "pinching_stiffness_ratio": "R_4",
    "plastic_drift_to_capping": "u_p",
    "post_capping_deterioration_drift": r"\Lambda_C",
    "post_capping_drift": "u_{pc}",
    "post_yield_stiffness": "k_2",
    "radius": "R",
    "reloading_deterioration_drift": r"\Lambda_A",
    "reloading_drift": "r_D",
    "reloading_drift_ratio": r"\beta",
    "reloading_exponent": r"\alpha_r",
    "reloading_force": "r_F",
    "residual_force_ratio": "r_r",
    "restitution": "e",
    "slip_drift": "u_s",
    "slip_force": "F_s",
    "softening_ratio": "R_2",
    "stiffness_loss": r"\delta_\eta",
    "stiffness_ratio": r"\rho",
    "strength_deterioration_drift": r"\Lambda_S",
    "strength_loss": r"\delta_\nu",
    "total_slip": r"\zeta_s",
    "transition_curvature": "R_0",
    "ultimate_drift": "u_u",
    "unloading_deterioration_drift": r"\Lambda_K",
    "unloading_exponent": r"\beta_u",
    "unloading_force": "u_F",
    "unloading_stiffness_ratio": "R_3",
    "velocity_exponent": r"\alpha_v",
    "weight": "W",
    "yield_force": "F_y",
} | {
    f"{kind}_damage_{part}": f"g_{{{letter}{index}}}"
    for kind, letter in {"stiffness": "K", "reloading": "D", "strength": "F"}.items()
    for part, index in {"by_drift": 1, "by_use": 2, "drift_exponent": 3, "use_exponent": 4, "limit": r"\max"}.items()
}
# Symbols that differ in one law, because its literature uses others.
OF_LAW = {
    "saws": {"yield_force": "F_0", "pinching_force_ratio": "F_I/F_0", "hardening_ratio": "R_1"},
}


def symbol(law: str, parameter: str) -> str:
    """Return the symbol of a parameter of a law or device.

    Raises:
        ValueError: If the parameter has no symbol, as after a new law was added.
    """
    name = parameter.removesuffix(_NEGATIVE)
    found = OF_LAW.get(law, {}).get(name) or SYMBOLS.get(name)
    if found is None:
        raise ValueError(
            f"parameter {name!r} of {law!r} has no symbol in the theory manual: add it to SYMBOLS in "
            "docs/generate/theory_symbols.py"
        )
    return found


def parameter_list(law: str, element: type[StoreyElement]) -> str:
    """Return symbol, name, unit and OpenSees' name of each parameter as one sentence in Markdown."""
    own = {name: known for name, known in element.parameters.items() if not name.endswith(_NEGATIVE)}
    parts = [f"${symbol(law, name)}$ {_named(name, known.units, known.opensees)}" for name, known in own.items()]
    words = "; ".join(parts) if parts else "the `stiffness` of the storey only"
    negative = ", ".join(f"`{name}`" for name in element.parameters if name.endswith(_NEGATIVE))
    return f"{words}.{f' Negative side: {negative}.' if negative else ''}"


def _named(name: str, units: str, opensees: str | None) -> str:
    inside: Mapping[str, str | None] = {"": None if units == "1" else units, "OpenSees ": opensees}
    words = ", ".join(f"{before}{value}" for before, value in inside.items() if value)
    return f"`{name}`{f' ({words})' if words else ''}"
