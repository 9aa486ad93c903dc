"""Laws, methods, loads, dampings and recorders together: the cases of the tests of combinations.

The factors are the tables of the engine, so that a new row is included. The library covertable chooses cases in which
all compatible pairs occur:

- Of structures (chains of one, two and five storeys, dense systems of one and three degrees of freedom), laws of few
  values, sources of methods, dampings, kinds of load, number types and what is recorded. The methods of a source, which
  differ by constants alone, and random motions of one, two and four states are taken in turn.
- Of laws of many values, explicit and implicit methods, chains of two and five storeys and number types. They share all
  else with the laws of few values: it is taken in turn.
- `pytest -m thorough` runs those, and what is left of law x method x dtype, and of dense systems by method x dtype.
- By default as many of them are run, with as few and as small kernels, as show every value of each factor, every value
  with each kind of method and with each family of structures, which decide on the kernel's skeleton, and every number
  of storeys with each kind of method, damping and law.

What is recorded is one of the rows of RECORDED: every recorder, one recorder alone, every recorder beside whole
histories or beside one alone.

Storey loops of the two-storey chains are left rolled, the form that buildings above eight storeys have; the others are
unrolled as shipped. sm_90 gets a kernel for every law x load and for every method, with the other tables' rows in turn.
"""

from collections import Counter
from dataclasses import replace
from functools import cache
from itertools import combinations, product

import covertable
import numpy as np
from law_rows import SPRINGS, rules_of
from matrices import modal_damping_matrix
from method_sources import by_source, shown, source_of

import warpdyn as wd
from warpdyn.campaigns.integration.model import dynamics_of
from warpdyn.engine.kernels import build, output_table
from warpdyn.engine.kernels.loads import LOADS
from warpdyn.engine.kernels.plan import DTYPES, Plan
from warpdyn.engine.laws import LAWS
from warpdyn.engine.methods.stability_limits import stability_limit
from warpdyn.engine.methods.table import LINEAR, METHODS, fitting_methods
from warpdyn.model.structures.shear_building import DAMPING

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
    "flag_height": 0.7,
    "drift_at_peak_force": 0.01,
    "softening_ratio": 0.05,
    "pinching_stiffness_ratio": 0.02,
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
    {"exponent": 1.0, "beta": 0.5, "gamma": 0.5},
    {"exponent": 2.0},
    {"exponent": 3.0},
    {"isotropic_hardening": 0.1},
    {"deterioration_exponent": 1.5},
    {"unloading_exponent": 0.5},
    {"slip_drift": 0.004, "bearing_drift": 0.006},
    {"yield_force_negative": 400.0},
    {"yield_force_negative": 400.0, "strength_damage_limit": 0.3, "strength_damage_by_use": 0.3},
    {
        "yield_force_negative": 400.0,
        "strength_damage_limit": 0.3,
        "strength_damage_by_use": 0.01,
        "counts_cycles": 1.0,
    },
    {"strength_damage_limit": 0.3, "strength_damage_by_use": 0.3},
    {"strength_damage_limit": 0.3, "strength_damage_by_use": 0.01, "counts_cycles": 1.0},
    {"total_slip": 0.5, "pinching_rate": 0.1, "strength_loss": 0.01},
    {"total_slip": 0.5, "pinching_rate": 0.1, "strength_loss": 0.01, "exponent": 1.5},
)


def value_of(name, parameter, own):
    """Return a parameter's value that leads to a row, its usual one, its default or any within its bounds."""
    known = VALUES | own
    if name in known or parameter.default is not None:
        return known.get(name, parameter.default)
    return (parameter.low + parameter.high) / 2 if np.isfinite(parameter.high) else max(parameter.low, 0.0) + 1.0


@cache
def springs_of_laws():
    """Return for every row of SPRINGS that a law leads to: the law, and the parameters that lead to it."""
    found = {}
    for law, row in LAWS.items():
        for own in OF_A_ROW:
            known = {name: each for name, each in row.parameters.items() if not each.optional or name in own}
            values = {name: value_of(name, parameter, own) for name, parameter in known.items()}
            spring = row.spring({name: np.full((1, 1), value) for name, value in values.items()})
            found.setdefault(spring, (law, values))
    return found


def make_structure(family, dofs, damping, spring):
    if family == "dense":
        mass = np.full(dofs, 1e3)
        stiffness = np.diag([8e5] * (dofs - 1) + [4e5]) - 4e5 * (np.eye(dofs, k=1) + np.eye(dofs, k=-1))
        return wd.LinearSystem(mass, modal_damping_matrix(mass, stiffness, VALUES["damping_ratio"]), stiffness)
    law, values = springs_of_laws()[spring]
    values = values | {name: VALUES[name] for name in DAMPING[damping].parameters}
    return wd.ShearBuilding(np.full(dofs, 1e3), 4e5, 3.0, law=law, damping=damping, **values)


def make_excitation(load, dofs):
    """Return a load under which every nonlinear law yields."""
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


# Laws of few values are combined with all there is.
FEW = [name for name, spring in SPRINGS.items() if spring.memory <= 1]
MANY = [name for name in SPRINGS if name not in FEW]
RECORDERS = {
    family: {name: variables for name, variables in rows.items() if name != "floor_spectra"}
    for family, rows in output_table.RECORDERS.items()
}
SOURCES = list(by_source([*fitting_methods(LAWS["bouc_wen"].forces), *METHODS]))  # those that fit every law first
# These amplify what is not damped at any step, and are flagged for it.
GROWING = [name for name, method in METHODS.items() if stability_limit(method, 0.0) == 0]
STRUCTURES = (("chain", 1), ("chain", 2), ("chain", 5), ("dense", 1), ("dense", 3))
RECORDED = (("all",), ("alone",), ("all", "alone"), ("all", "histories"))
FACTORS = {
    "structure": STRUCTURES,
    "law": FEW,
    "source": SOURCES,
    "damping": (*KERNEL_DAMPING, "matrix"),
    "load": LOAD_KINDS,
    "dtype": list(DTYPES),
    "recorded": RECORDED,
}
CONSTRAINED = ("structure", "law", "source", "damping")  # the others go with everything
FACTORS_OF_MANY = {
    "law": MANY,
    "kind": ("explicit", "implicit"),
    "structure": (("chain", 2), ("chain", 5)),
    "dtype": list(DTYPES),
}


def methods_of(row):
    """Return the methods of a row's source that integrate its structure."""
    law, _ = springs_of_laws()[row["law"]]
    forces = LINEAR if row["structure"][0] == "dense" else LAWS[law].forces
    fitting = fitting_methods(forces, row["damping"])
    growing = GROWING if row["damping"] == "none" else ()
    return [name for name in fitting if source_of(name) == row["source"] and name not in growing]


def may_meet(row):
    """Return whether there is a structure of this family, law and damping, and a method of this source for it."""
    is_dense = row["structure"][0] == "dense"
    if is_dense != (row["damping"] == "matrix") or (is_dense and row["law"] != "elastic"):
        return False
    return bool(methods_of(row))


def pairs_of(row):
    """Return the pairs of values that meet in a row."""
    return set(combinations(row.items(), 2))


def recording_little(rows):
    """Return the rows with a kernel less where no pair is lost by it."""
    rows = list(rows)
    for place, row in enumerate(rows):
        elsewhere = set().union(*map(pairs_of, rows[:place] + rows[place + 1 :]))
        for recorded in RECORDED if len(row["recorded"]) > 1 else ():
            less = row | {"recorded": recorded}
            if len(recorded) == 1 and pairs_of(row) <= elsewhere | pairs_of(less):
                rows[place] = less
    return rows


def rows_of_few():
    """Return rows in which every pair of FACTORS meets that may."""
    constraint = {"operator": "fn", "requires": CONSTRAINED, "evaluate": may_meet}
    return recording_little(covertable.make(FACTORS, constraints=[constraint]))


def rows_of_many():
    """Return rows in which every pair of FACTORS_OF_MANY meets, with all else in turn."""
    rows, turns = [], Counter()
    for place, row in enumerate(covertable.make(FACTORS_OF_MANY)):
        sources = [source for source in SOURCES if source[0] == row["kind"]]
        row |= {"load": in_turn(LOAD_KINDS, place), "recorded": ("alone",)}
        others = [{"source": source, "damping": damping} for damping, source in product(KERNEL_DAMPING, sources)]
        fitting = [other for other in others if may_meet(row | other)]
        # Coprime to how many there are of each, a stride leads to all of them.
        rows.append(row | in_turn(fitting, 7 * turns[row["kind"]]))
        turns[row["kind"]] += 1
    return rows


def cases_of(rows):
    """Return what is recorded by case, with the methods of every source and the random motions in turn."""
    cases, turns = {}, Counter()
    for row in rows:
        method = in_turn(methods_of(row), turns[row["source"]])
        load = in_turn(NOISE, turns["noise"]) if row["load"] == "noise" else row["load"]
        turns.update([row["source"], row["load"]])
        case = (*row["structure"], row["damping"], row["law"], load, method, row["dtype"])
        cases[case] = tuple(dict.fromkeys((*cases.get(case, ()), *row["recorded"])))
    return cases


def remaining_cases(met):
    """Return every law with every method that fits it, and dense systems with every method, in every dtype, not met."""
    known = {(case[0], case[3], *case[5:]) for case in met}
    cases = []
    for (law_at, (spring, (law, _))), (dtype_at, dtype) in product(
        enumerate(springs_of_laws().items()), enumerate(DTYPES)
    ):
        for method_at, method in enumerate(fitting_methods(LAWS[law].forces)):
            turn = law_at + method_at + dtype_at
            damping = in_turn(USUAL_DAMPING, turn)
            damping = "storey" if damping == "none" and method in GROWING else damping
            load = in_turn(LOADS, 2 * law_at + method_at)
            if ("chain", spring, method, dtype) not in known:
                cases.append(("chain", 2, damping, spring, load, method, dtype))
            is_new = ("dense", spring, method, dtype) not in known
            if spring == "elastic" and method in fitting_methods(LINEAR) and is_new:
                cases.append(("dense", in_turn((1, 3), turn), "matrix", spring, load, method, dtype))
    return cases


RECORDED_IN = cases_of(rows_of_few()) | cases_of(rows_of_many())
COVERING = list(RECORDED_IN)
REMAINING = remaining_cases(COVERING)
RECORDED_IN |= dict.fromkeys(REMAINING, ("alone",))
SHOWN = shown(METHODS)


def load_in_turn(turn, turn_of_noise):
    kind = in_turn(LOAD_KINDS, turn)
    return in_turn(NOISE, turn_of_noise) if kind == "noise" else kind


# Laws of many values meet methods whose kernels are small: evaluated once in each stage, they take long to compile.
SMALL = ("velocity_verlet", "newmark_average", "rk4", "central_difference")
# Rows of SPRINGS that a law leads to share their source but for a few terms.
ROW_OF_LAW = {law: spring for spring, (law, _) in reversed(springs_of_laws().items())}
SM90 = [
    (
        "chain",
        2,
        in_turn(USUAL_DAMPING, i + j),
        spring,
        load_in_turn(j, i),
        in_turn(fitting_methods(LAWS[law].forces) if spring in FEW else SMALL, 4 * i + j),
        in_turn(DTYPES, i + j),
    )
    for (i, (spring, (law, _))), (j, _) in product(enumerate(springs_of_laws().items()), enumerate(LOAD_KINDS))
    if spring in FEW or j == 0
] + [
    ("dense", 3, "matrix", "elastic", load_in_turn(i, i), method, in_turn(DTYPES, i // 4))
    for i, method in enumerate(fitting_methods(LINEAR))
]


def is_default_on_sm90(case):
    """Return whether a case is run by default: one method a source, one row a law, of laws of few values some loads."""
    family, _, _, spring, load, method, _ = case
    if family == "dense":
        return method in SHOWN
    kind = "noise" if load in NOISE else load
    if method == "stoermer" and spring in FEW:  # not for dense systems
        return True
    if spring in MANY:
        return spring in ROW_OF_LAW.values()
    turn = (FEW.index(spring) - LOAD_KINDS.index(kind)) % len(LOAD_KINDS)
    # The rows of Bouc-Wen differ by their rate alone.
    return turn == 0 or (turn == 1 and springs_of_laws()[spring][0] != "bouc_wen")


def recorders_alone(cases):
    """Return the recorder that each case has alone, in turn."""
    turns, found = Counter(), {}
    for case in cases:
        found[case] = in_turn(RECORDERS[case[0]], turns[case[0]])
        turns[case[0]] += "alone" in RECORDED_IN.get(case, ("alone",))
    return found


def shown_by(case):
    """Return what a case shows: its values, those of few values with its kind of method and family, and storeys."""
    family, dofs, damping, law, load, method, dtype = case
    kind, recorded = METHODS[method].kind, RECORDED_IN[case]
    values = {*enumerate(case[2:]), recorded, source_of(method), ((family, dofs), kind)}
    if "alone" in recorded:
        values.add((family, ALONE[case]))
    if law in MANY:
        return values
    load = "noise" if load in NOISE else load
    values |= set(product((family, kind), (family, kind, damping, law, load, dtype, recorded)))
    return values | set(product(((family, dofs),), (damping, law)))


def work_of(case):
    """Return how long a case's kernels take to compile, as a multiple of a small one: unrolled loops are long."""
    return len(RECORDED_IN[case]) * (2 if case[1] == 5 and not is_rolled(case) else 1)


def chosen(cases, shown_by):
    """Return cases that show all that the cases show, those first that show most for their work."""
    left, found = set().union(*map(shown_by, cases)), []
    while left:
        found.append(max(cases, key=lambda case: len(shown_by(case) & left) / work_of(case)))
        left -= shown_by(found[-1])
    for case in sorted(found, key=work_of, reverse=True):  # what those chosen later show, too, is not needed twice
        others = [other for other in found if other != case]
        if set().union(*map(shown_by, others)) >= shown_by(case):
            found = others
    return found


def is_rolled(case):
    """Return whether a case's loops stay rolled, which compiles in a fraction of the time."""
    return case[:2] == ("chain", 2) or case[3] in MANY


ALONE = recorders_alone([*RECORDED_IN, *(case for case in SM90 if case not in RECORDED_IN)])
DEFAULT = chosen(COVERING, shown_by)


def name_of(case):
    return "-".join(map(str, case))


def sm90_plan(case):
    """Return one of a case's plans as a GPU runs it: all recorders, histories, one recorder, in turn."""
    plans = list(plans_of(case, is_gpu=True).values())
    return plans[SM90.index(case) % len(plans)]


def plans_of(case, is_gpu=False):
    """Return the plans a case may have: every recorder, whole histories, one recorder alone."""
    family, dofs, damping, spring, load, method, dtype = case
    dynamics = dynamics_of(wd.Scene(make_structure(family, dofs, damping, spring), make_excitation(load, dofs)))
    if METHODS[method].kind == "exact":
        damping = "general" if dynamics.couples_modes else "classical"
    plan = Plan(family, dofs, rules_of(spring), damping, load, tuple(sorted(RECORDERS[family])), method, dtype)
    plan = build.fitted(plan, is_gpu)
    if is_rolled(case) and not is_gpu:
        plan = replace(plan, max_unroll=1)
    # Samples of these laws are judged by their peak drifts, which are recorded beside what is asked for.
    judging = {"drift"} if family == "chain" and dynamics.is_sensitive else set()
    alone = replace(plan, recorders=tuple(sorted({ALONE[case], *judging})))
    return {"all": plan, "histories": build.history_plan(plan), "alone": alone}


def launches_of(case):
    """Return the plans that a case launches, in their order."""
    return [plan for name, plan in plans_of(case).items() if name in RECORDED_IN[case]]
