"""Every law with every method: the cases of the tests of combinations, from the engine's own tables.

A new row of a table is in them. What one case is:

- Chains of two storeys under every law x method, and dense systems of one and three degrees of freedom under every
  method x dtype. Damping, load, dtype and what is recorded are taken in turn, so that every law and every method meets
  every one of them, and they each other.
- Chains of one storey and of five under every damping x law with the other tables' rows in turn.

What is recorded is one of the rows of RECORDED: every recorder, one recorder alone, every recorder beside whole
histories or beside one alone.

Random motions of one, two and four states are one kind of load, whose rows are taken in turn.

Storey loops of the two-storey chains are left rolled, the form that buildings above eight storeys have; the others are
unrolled as shipped. sm_90 gets a kernel for every law x load and for every method, with the other tables' rows in turn.
"""

from dataclasses import replace
from itertools import product

import numpy as np

import warpdyn as wd
from warpdyn.kernels import build
from warpdyn.kernels.loads import LOADS
from warpdyn.kernels.plan import DTYPES, Plan, keeps_slopes
from warpdyn.kernels.springs import SPRINGS
from warpdyn.laws import LAWS
from warpdyn.methods import METHODS, fitting_methods
from warpdyn.modal import modal_damping_matrix
from warpdyn.propagators import damping_of
from warpdyn.recorders import RECORDERS
from warpdyn.stability import stability_limit
from warpdyn.structures import DAMPING

SAMPLES = 17  # one full row of lanes, and one that repeats its only sample
VALUES = {  # of every parameter that a law or a damping takes
    "yield_force": 500.0,
    "hardening_ratio": 0.05,
    "beta": 0.6,
    "gamma": 0.4,
    "plastic_drift_to_capping": 0.005,
    "post_capping_drift": 0.02,
    "capping_force_ratio": 1.1,
    "residual_force_ratio": 0.2,
    "ultimate_drift": 0.0,
    "strength_deterioration_drift": 0.2,
    "post_capping_deterioration_drift": 0.2,
    "unloading_deterioration_drift": 0.3,
    "reloading_deterioration_drift": 0.3,
    "deterioration_rate": 0.9,
    "pinching_force_ratio": 0.4,
    "pinching_drift_ratio": 0.5,
    "ductility_2": 2.0,
    "force_ratio_2": 1.4,
    "ductility_3": 5.0,
    "force_ratio_3": 1.8,
    "cracking_ratio": 0.5,
    "cracked_stiffness_ratio": 0.4,
    "ductility_4": 10.0,
    "force_ratio_4": 1.0,
    "post_yield_stiffness": 2e4,
    "damping_coefficient": 2e3,
    "damping_ratio": 0.05,
}
USUAL_DAMPING = ("none", "storey", "rayleigh", "modal")
# Damping in proportion to stiffness alone is dashpots to a kernel.
KERNEL_DAMPING = [name for name in DAMPING if name != "stiffness_proportional"]
NOISE = [name for name, row in LOADS.items() if row.noise_states]
LOAD_KINDS = [*(name for name in LOADS if name not in NOISE), "noise"]
OF_A_ROW = (  # each has a row of SPRINGS of its own
    {"exponent": 1.0},
    {"exponent": 2.0},
    {"exponent": 3.0},
    {"isotropic_hardening": 0.1},
    {"deterioration_exponent": 1.5},
    {"unloading_exponent": 0.5},
    {"strength_damage_limit": 0.3, "strength_damage_by_use": 0.3},
    {"strength_damage_limit": 0.3, "strength_damage_by_use": 0.01, "counts_cycles": 1.0},
    {"total_slip": 0.5, "pinching_rate": 0.1, "strength_loss": 0.01},
    {"total_slip": 0.5, "pinching_rate": 0.1, "strength_loss": 0.01, "exponent": 1.5},
)


# Laws of few values are combined with all there is. Those of more share all that with them: what is theirs alone stands
# in kernels of an explicit and an implicit method, of all sources that a method can have in turn, and in five storeys.
FEW = [name for name, spring in SPRINGS.items() if spring.memory <= 1]
MANY = [name for name in SPRINGS if name not in FEW]
FRICTION = {"devices": ("friction_damper",), "slip_force": 200.0, "brace_stiffness": 4e5}
STOP = {"clearance": 0.001, "contact_stiffness": 4e5, "restitution": 0.7}
DAMPER = {"damper_coefficient": 500.0, "velocity_exponent": 0.5}
# Rows of SPRINGS made of several, and viscous dampers: laws of the storeys and devices that lead to them.
COMBINED = {
    "bouc_wen_1+slip": {"law": ("bouc_wen",) * 2, **FRICTION},
    "bilinear|bouc_wen_1+gap": {"law": ("lead_rubber_bearing", "bouc_wen"), "devices": ("gap",), **STOP},
    "bouc_wen|takeda|elastic+slip": {"law": ("bouc_wen", "takeda", "elastic"), "exponent": 1.5, **FRICTION},
    "bilinear|menegotto_pinto+slip+gap": {
        "law": ("bilinear", "menegotto_pinto"), **FRICTION, **STOP, "devices": ("friction_damper", "gap")
    },
    "elastic": {"law": ("elastic",) * 2, "devices": ("viscous_damper",), **DAMPER},
    "bilinear+slip": {
        "law": ("bilinear",) * 3, **FRICTION, **DAMPER, "devices": ("viscous_damper", "friction_damper")
    },
}  # fmt: skip


def springs_of_laws():
    """Return for every row of SPRINGS that a law leads to: the law, and the parameters that lead to it."""
    found = {}
    for law, row in LAWS.items():
        for own in OF_A_ROW:
            values = {name: (VALUES | own).get(name, parameter.default) for name, parameter in row.parameters.items()}
            spring = row.spring({name: np.full((1, 1), value) for name, value in values.items()})
            found.setdefault(spring, (law, values))
    return found


def make_structure(family, dofs, damping, spring):
    if family == "dense":
        mass = np.full(dofs, 1e3)
        stiffness = np.diag([8e5] * (dofs - 1) + [4e5]) - 4e5 * (np.eye(dofs, k=1) + np.eye(dofs, k=-1))
        return wd.LinearSystem(mass, modal_damping_matrix(mass, stiffness, VALUES["damping_ratio"]), stiffness)
    law, values = springs_of_laws()[spring]
    values = values | {name: VALUES[name] for name in DAMPING[damping]}
    return wd.ShearBuilding(np.full(dofs, 1e3), 4e5, 3.0, law=law, damping=damping, **values)


def make_excitation(load, dofs):
    """Return a load that takes every nonlinear law beyond yield."""
    wave = 1.5 * np.sin(np.arange(30) * 0.4)
    noise = {"duration": 0.58, "interval": 0.02}
    return {
        "base_acceleration": lambda: wd.GroundMotion(wave, 0.02),
        "white_noise": lambda: wd.FilteredNoise(wd.WhiteNoise(0.0008), **noise),
        "kanai_tajimi": lambda: wd.FilteredNoise(wd.KanaiTajimi(0.003, 15, 0.6), **noise),
        "clough_penzien": lambda: wd.FilteredNoise(wd.CloughPenzien(0.003, 15, 0.6, 1.5, 0.6), **noise),
        "force_history": lambda: wd.ForceHistory(np.outer(1e3 * wave, np.arange(1, dofs + 1)), 0.02),
        "harmonic_force": lambda: wd.HarmonicForce(np.full(dofs, 1e3), 12.0, 0.6),
        "free_vibration": lambda: wd.FreeVibration(0.6, velocity=0.1 * np.arange(1, dofs + 1)),
    }[load]()


def in_turn(table, turn):
    return list(table)[turn % len(table)]


def load_in_turn(turn, turn_of_noise):
    kind = in_turn(LOAD_KINDS, turn)
    return in_turn(NOISE, turn_of_noise) if kind == "noise" else kind


def source_of(method):
    """Return what decides on a kernel's source: methods that have it in common differ by constants alone."""
    row = METHODS[method]
    if row.kind != "explicit":
        return row.kind, getattr(row, "beta", 0) > 0, getattr(row, "force_lag", 0) > 0
    return row.kind, keeps_slopes(row), row.is_adaptive, row.is_nystroem, row.starts_halfway


def methods_for(spring, law, law_at):
    """Return the methods that a law meets: all that fit, or an explicit and an implicit one, their sources in turn."""
    fitting = fitting_methods(law)
    if spring in FEW:
        return fitting
    alike = {source_of(name): [] for name in fitting}
    for name in fitting:
        alike[source_of(name)].append(name)
    kinds = ([names for source, names in alike.items() if source[0] == kind] for kind in ("explicit", "implicit"))
    return [in_turn(in_turn(sources, law_at), law_at // len(sources)) for sources in kinds]


def chain_cases():
    """Return laws x methods with one damping, load and dtype each."""
    cases = []
    for law_at, (spring, (law, _)) in enumerate(springs_of_laws().items()):
        for at, method in enumerate(methods_for(spring, law, law_at)):
            method_at = list(METHODS).index(method)
            damping = in_turn(USUAL_DAMPING, method_at + law_at)
            if damping == "none" and method in GROWING:
                damping = "storey"
            load = load_in_turn(method_at + 2 * law_at, method_at)
            dtype = in_turn(DTYPES, (method_at // 2 if spring in FEW else at) + law_at)
            cases.append(("chain", 2, damping, spring, load, method, dtype))
    return cases


# These amplify what is not damped at any step, and are flagged for it.
GROWING = [name for name, method in METHODS.items() if stability_limit(method, 0.0) == 0]
# Those that do not fit every law do not meet every load and damping either.
CHOOSY = set(METHODS) - set.intersection(*(set(fitting_methods(law)) for law in LAWS))
STABLE = [name for name in fitting_methods("bouc_wen") if name not in GROWING]


def stable(damping):
    """Return the methods that fit every law and a damping, and amplify nothing."""
    return [name for name in STABLE if name in fitting_methods("bouc_wen", damping)]


FULL = chain_cases()
RECORDED = (("all",), ("all", "histories"), ("alone",), ("all", "alone"))
IN_TURN = [
    ("chain", dofs, damping, spring, load_in_turn(i + j, i), in_turn(stable(damping), 5 * i + j + dofs), dtype)
    for dofs, dtype in ((1, "float64"), (5, "float32"))
    for (i, damping), (j, spring) in product(enumerate(KERNEL_DAMPING), enumerate(SPRINGS))
    if (spring in FEW if dofs == 1 else i == j % len(KERNEL_DAMPING))
]
DENSE = [
    ("dense", (1, 3)[turn // 2 % 2], "matrix", "elastic", load_in_turn(turn + turn // 4, turn), method, dtype)
    for turn, (method, dtype) in enumerate(product(METHODS, DTYPES))
]
CASES = FULL + IN_TURN + DENSE
SM90 = [
    (
        "chain",
        2,
        in_turn(USUAL_DAMPING, i + j),
        spring,
        load_in_turn(j, i),
        in_turn(fitting_methods(law), 4 * i + j),
        in_turn(DTYPES, i + j),
    )
    for (i, (spring, (law, _))), (j, _) in product(enumerate(springs_of_laws().items()), enumerate(LOAD_KINDS))
    if spring in FEW or j == 0
] + [("dense", 3, "matrix", "elastic", load_in_turn(i, i), m, in_turn(DTYPES, i // 4)) for i, m in enumerate(METHODS)]


def recorded_in(case):
    """Return what a case's kernels record, a row of RECORDED in turn."""
    _, dofs, damping, spring, _, method, _ = case
    law_at, method_at = list(SPRINGS).index(spring), list(METHODS).index(method)
    if case in FULL and spring in MANY:
        return ("alone",)
    if case in FULL:
        turn = method_at + method_at // len(RECORDED) + 3 * law_at
    elif case in DENSE:
        turn = DENSE.index(case) + DENSE.index(case) // len(RECORDED)
    else:
        turn = law_at + (KERNEL_DAMPING.index(damping) if dofs == 1 else 0)
    return in_turn(RECORDED, turn)


def recorder_alone(family, dofs, damping, spring, load, method, dtype):
    """Return the recorder that this case has alone; neighbours along every axis have another."""
    place = dofs + list(SPRINGS).index(spring) + list(LOADS).index(load) + list(DTYPES).index(dtype)
    place += list(METHODS).index(method)
    place += KERNEL_DAMPING.index(damping) if damping in KERNEL_DAMPING else 0
    return list(RECORDERS[family])[place % len(RECORDERS[family])]


def name_of(case):
    return "-".join(map(str, case))


def sm90_plan(case):
    """Return one of a case's plans as a GPU runs it: all recorders, histories, one recorder, in turn."""
    plans = list(plans_of(case, is_gpu=True).values())
    return plans[SM90.index(case) % len(plans)]


def is_rolled(case):
    """Return whether a case's loops are left rolled, which compiles in a fraction of the time."""
    return case in FULL or case[3] in MANY


def plans_of(case, is_gpu=False):
    """Return the plans a case may have: every recorder, whole histories, one recorder alone."""
    family, dofs, damping, spring, load, method, dtype = case
    if METHODS[method].kind == "exact":
        damping = damping_of(wd.Scene(make_structure(family, dofs, damping, spring), make_excitation(load, dofs)))
    plan = Plan(family, dofs, spring, damping, load, tuple(sorted(RECORDERS[family])), method, dtype)
    plan = build.fitted(plan, is_gpu)
    if is_rolled(case) and not is_gpu:
        plan = replace(plan, max_unroll=1)
    alone = replace(plan, recorders=(recorder_alone(*case),))
    return {"all": plan, "histories": build.history_plan(plan), "alone": alone}


def launches_of(case):
    """Return the plans that a case launches, in their order."""
    return [plan for name, plan in plans_of(case).items() if name in recorded_in(case)]


def combined_structure(row, damping):
    """Return a building of a row of COMBINED."""
    given = COMBINED[row]
    taken = {name for law in given["law"] for name in LAWS[law].parameters} | set(DAMPING[damping])
    values = {name: VALUES[name] for name in taken if name in VALUES}
    return wd.ShearBuilding(np.full(len(given["law"]), 1e3), 4e5, 3.0, damping=damping, **values | given)


SOME = ("rk4", "nystroem4", "velocity_verlet", "dormand_prince54", "central_difference", "newmark_average", "hht_alpha")
