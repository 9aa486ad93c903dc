"""Every law with every method: the cases of the tests of combinations, from the engine's own tables.

A new row of a table is in them. What one case is:

- Chains of two storeys under every law x source of methods, and dense systems of one and three degrees of freedom under
  every source x dtype. Damping, load, dtype and what is recorded are taken in turn, so that every law and every source
  meets every one of them, and they each other; so are the methods of a source, which differ by constants alone.
- Chains of one storey and of five under every damping x law with the other tables' rows in turn.
- `pytest -m thorough` adds what is left of law x method x dtype.

What is recorded is one of the rows of RECORDED: every recorder, one recorder alone, every recorder beside whole
histories or beside one alone.

Random motions of one, two and four states are one kind of load, whose rows are taken in turn.

Storey loops of the two-storey chains are left rolled, the form that buildings above eight storeys have; the others are
unrolled as shipped. sm_90 gets a kernel for every law x load and for every method, with the other tables' rows in turn.
"""

from dataclasses import replace
from itertools import product

import numpy as np
from method_sources import by_source, shown, source_of

import warpdyn as wd
from warpdyn.core.output_variables import RECORDERS
from warpdyn.integration.propagators import damping_of
from warpdyn.kernels import build
from warpdyn.kernels.loads import LOADS
from warpdyn.kernels.plan import DTYPES, Plan
from warpdyn.laws import LAWS
from warpdyn.laws.springs import SPRINGS
from warpdyn.methods.stability_limits import stability_limit
from warpdyn.methods.table import METHODS, fitting_methods
from warpdyn.structures.modal import modal_damping_matrix
from warpdyn.structures.shear_building import DAMPING

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
SOURCES = list(by_source([*fitting_methods("bouc_wen"), *METHODS]))  # those that fit every law first


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


def methods_for(spring, law, law_at):
    """Return the methods that a law meets: one of every source, or an explicit and an implicit one, in turn."""
    alike = by_source(fitting_methods(law))
    if spring in FEW:
        # Those that need damping last: the law that has none meets one that does not.
        return [in_turn(sorted(names, key=GROWING.__contains__), law_at) for names in alike.values()]
    kinds = ([names for source, names in alike.items() if source[0] == kind] for kind in ("explicit", "implicit"))
    return [in_turn(in_turn(sources, law_at), law_at // len(sources)) for sources in kinds]


def chain_case(spring, method, dtype, turn, turn_of_load, turn_of_noise):
    damping = in_turn(USUAL_DAMPING, turn)
    if damping == "none" and method in GROWING:
        damping = "storey"
    return "chain", 2, damping, spring, load_in_turn(turn_of_load, turn_of_noise), method, dtype


def chain_cases():
    """Return laws x sources of methods with one damping, load and dtype each."""
    cases = []
    for law_at, (spring, (law, _)) in enumerate(springs_of_laws().items()):
        for at, method in enumerate(methods_for(spring, law, law_at)):
            source_at = SOURCES.index(source_of(method))
            dtype = in_turn(DTYPES, (source_at // 2 if spring in FEW else at) + law_at)
            cases.append(chain_case(spring, method, dtype, source_at + law_at, source_at + 3 * law_at, source_at))
    return cases


def remaining_cases(met):
    """Return every law with every method that fits it in every dtype, but for those met."""
    met = {(spring, method, dtype) for *_, spring, _, method, dtype in met}
    return [
        chain_case(spring, method, dtype, law_at + method_at + dtype_at, 2 * law_at + method_at, method_at)
        for law_at, (spring, (law, _)) in enumerate(springs_of_laws().items())
        for method_at, method in enumerate(fitting_methods(law))
        for dtype_at, dtype in enumerate(DTYPES)
        if (spring, method, dtype) not in met
    ]


# These amplify what is not damped at any step, and are flagged for it.
GROWING = [name for name, method in METHODS.items() if stability_limit(method, 0.0) == 0]
# Those that do not fit every law do not meet every load and damping either.
CHOOSY = set(METHODS) - set.intersection(*(set(fitting_methods(law)) for law in LAWS))
STABLE = [name for name in fitting_methods("bouc_wen") if name not in GROWING]


def stable(damping):
    """Return the methods that fit every law and a damping, and amplify nothing."""
    return [name for name in STABLE if name in fitting_methods("bouc_wen", damping)]


FULL = chain_cases()
REMAINING = remaining_cases(FULL)
RECORDED = (("all",), ("all", "histories"), ("alone",), ("all", "alone"))
IN_TURN = [
    ("chain", dofs, damping, spring, load_in_turn(i + j, i), in_turn(stable(damping), 5 * i + j + dofs), dtype)
    for dofs, dtype in ((1, "float64"), (5, "float32"))
    for (i, damping), (j, spring) in product(enumerate(KERNEL_DAMPING), enumerate(SPRINGS))
    if (spring in FEW if dofs == 1 else i == j % len(KERNEL_DAMPING))
]
SHOWN = shown(METHODS)
METHODS_IN_TURN = sorted(METHODS, key=lambda method: method not in SHOWN)
DENSE = [
    ("dense", (1, 3)[turn // 2 % 2], "matrix", "elastic", load_in_turn(turn + turn // 4, turn), method, dtype)
    for turn, (method, dtype) in enumerate(product(METHODS_IN_TURN, DTYPES))
]
# Rows of SPRINGS that a law leads to share their source but for a few terms: in five storeys one of them is shown.
ROW_OF_LAW = {law: spring for spring, (law, _) in springs_of_laws().items()}
CASES = FULL + REMAINING + IN_TURN + DENSE


def is_default(case):
    """Return whether a case is one of those run by default; `pytest -m thorough` runs the others."""
    family, dofs, damping, spring, _, method, _ = case
    if family == "dense":
        return method in SHOWN
    if dofs == 1:
        return (KERNEL_DAMPING.index(damping) + FEW.index(spring)) % 2 == 0
    return case not in REMAINING if dofs == 2 else spring in FEW or spring in ROW_OF_LAW.values()


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


def is_default_on_sm90(case):
    """Return whether a case is run by default: one method a source, of laws of few values every other load."""
    family, _, _, spring, load, method, _ = case
    if family == "dense":
        return method in SHOWN
    kind = "noise" if load in NOISE else load
    return spring in MANY or (FEW.index(spring) + LOAD_KINDS.index(kind)) % 2 == 0


def recorded_in(case):
    """Return what a case's kernels record, a row of RECORDED in turn."""
    _, dofs, damping, spring, _, method, _ = case
    law_at = list(SPRINGS).index(spring)
    if case in REMAINING or (case in FULL and spring in MANY):
        return ("alone",)
    if case in FULL:
        method_at = SOURCES.index(source_of(method))
        turn = method_at + method_at // len(RECORDED) + 3 * law_at + law_at // 3
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
    return case[:2] == ("chain", 2) or case[3] in MANY


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
