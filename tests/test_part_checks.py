"""Faulty parts of kernels are refused with messages that name the fault, the file and the line."""

import importlib
import inspect
import re
from dataclasses import replace

import numpy as np
import pytest
from control_rules import CONTROLLED
from hinge_cases import motion, reference_model
from hinged_frame_cases import reference_model as hinged_frame
from law_rows import forces_of, rules_of
from test_fishbone_joint_springs import bone
from test_frame_storeys import grid_frame

import warpdyn as wd
from warpdyn.campaigns.integration.model import dynamics_of, plan_of
from warpdyn.engine.kernels import build, registry
from warpdyn.engine.kernels.composing.part_checks import check_parts
from warpdyn.engine.kernels.composing.source_text import bodies_of, slots_of
from warpdyn.engine.kernels.composition import compose
from warpdyn.engine.kernels.lumped.pattern import Pattern, table_of
from warpdyn.engine.kernels.output_table import RECORDERS
from warpdyn.engine.kernels.plan import Plan
from warpdyn.engine.kernels.slots import COMMON, INDICES, SCRATCH, SLOTS
from warpdyn.engine.methods.table import METHODS, fitting_methods
from warpdyn.foundations.core.output_variables import Variable

pytestmark = pytest.mark.fast

EVERY = tuple(sorted(RECORDERS["chain"]))
PLAIN = Plan("chain", 3, rules_of("bilinear"), "rayleigh", "base_acceleration", EVERY, "rk4", "float32", collapses=True)
LUMPED = Plan(
    *("lumped", 2, rules_of("bilinear"), "mass_proportional", "base_acceleration"),
    tuple(sorted(RECORDERS["lumped"])),
    *("rk4", "float32"),
    collapses=True,
    records_late=True,
    pattern=Pattern(*[table_of(np.array([[[2.0, 1.0], [-1.0, 3.0]]]))] * 7, has_dashpots=True),
)
MOTION = wd.GroundMotion(np.sin(np.arange(9.0)), 0.01, "sine")
TWISTING = wd.Scene(
    wd.TorsionalBuilding(
        [1e5, 1e5],
        [[-10.0, 10.0], [-6.0, 6.0]],
        [
            wd.PlanFrame(name, place, axis, 5e7, law="bouc_wen", yield_force=5e5, hardening_ratio=0.05)
            for name, place, axis in (("A", (0, 5), "x"), ("B", (0, -5), "x"), ("C", (-9, 0), "y"), ("D", (9, 0), "y"))
        ],
    ),
    wd.PairOfMotions(MOTION, MOTION),
    recorders=("acceleration", "displacement", "output", "residual", "spring"),
)
MIXED = wd.Scene(
    wd.LumpedStructure(
        {"x": 1e5, "y": 1e5},
        [
            wd.BiaxialSpring(
                "bearing",
                {"x": 1.0},
                {"y": 1.0},
                law="circular_yield",
                stiffness=1e7,
                yield_force=1e5,
                post_yield_stiffness=1e6,
            ),
            wd.Spring(
                "wall", {"x": 1.0}, law=wd.laws.YeLiZhuContact(clearance=1.0, hertz_stiffness=2e9, restitution=0.6)
            ),
        ],
        influence=[{"x": 1.0}, {"y": 1.0}],
        damping="mass_proportional",
        damping_ratio=0.05,
    ),
    wd.PairOfMotions(MOTION, MOTION),
)
DENSE = Plan(
    "dense", 3, rules_of("elastic"), "matrix", "force_history", tuple(sorted(RECORDERS["dense"])), "rk4", "float64"
)


class Part:
    def wanted(plan):
        return True


class misspelt_slot(Part):
    def see_force():  # fault
        wp.abs(restoring)


class misspelt_inner_slot(Part):
    def end_step():
        for i in range(N):
            for j in range(LANES):
                slot("accepted_drft")  # fault


class misspelt_variable(Part):
    def declare():
        peak_force = matrix()

    def see_forces():
        peak_force[i, j] = larger(peak_force[i, j], wp.abs(restorng))  # fault


class variable_of_another_slot(Part):
    def declare():
        peak_force = matrix()

    def see_drift():
        peak_force[i, j] = restoring  # fault


class undeclared_variable(Part):
    def see_forces():
        peak_force[i, j] = wp.abs(restoring)  # fault


class local_variable_of_the_skeleton(Part):
    def declare():
        peak_force = matrix()

    def see_forces():
        u = wp.abs(restoring)  # fault
        peak_force[i, j] = u


class local_variable_of_a_later_slot(Part):
    def see_forces():
        c = wp.abs(restoring)  # fault


class declared_variable_of_the_skeleton(Part):
    def declare():
        us = matrix()  # fault


class declared_variable_of_another_part(Part):
    def declare():
        peak_drift = matrix()  # fault


class declared_constant_of_another_part(Part):
    def declare():
        oscillator_factors = row()  # fault


class local_variable_of_another_part(Part):
    def see_forces():
        peak_shear = wp.abs(restoring)  # fault


class forbidden_change(Part):
    def see_drift():
        drift = dtype(0.0)  # fault


class forbidden_change_of_an_element(Part):
    def see_drift():
        v[i, j] = dtype(0.0)  # fault


class changed_loop_variable(Part):
    def see_drift():
        for j in range(LANES):  # fault
            wp.abs(drift)


class changed_constant(Part):
    def see_drift():
        STAGES = 1  # fault


class changed_input(Part):
    def see_drift():
        structures.mass[g, 0] = drift  # fault


class misspelt_condition(Part):
    def see_state():
        if COLAPSE:  # fault
            standing = 1


class unknown_field(Part):
    def finish_storey():
        output.peak_storey_force[g, o] = dtype(0.0)  # fault


class slot_on_a_line_with_others(Part):
    def end_step():
        for i in range(N):
            for j in range(LANES):
                slot('accepted_drift')  # fault  # fmt: skip


class returned_value(Part):
    def see_drift():
        return drift  # fault


class unknown_lender(Part):
    BORROWS = {"drifts": ("peak_drift",)}  # fault

    def see_drift():
        wp.abs(peak_drift[i, j])


class unknown_loan(Part):
    BORROWS = {"drift": ("peak_drifts",)}  # fault

    def see_drift():
        wp.abs(drift)


class variable_that_this_method_lacks(Part):
    BORROWS = {"adaptivity": ("done",)}

    def see_drift():
        output.time_of_peak_drift[0] = done[j]  # fault


class variable_that_is_not_written(Part):
    VARIABLES = {"chain": {"time_of_peak_drift": Variable((), "s", "time")}}

    def declare():  # fault
        time_now = row()

    def see_mode():  # a slot of another skeleton
        output.time_of_peak_drift[0] = dtype(0.0)


class other_type_of_a_field(Part):
    FIELDS = {"Output": {"status": "float[]"}}  # fault


class unknown_struct(Part):
    FIELDS = {"Sample": {"cost": "float[]"}}  # fault


class unknown_type(Part):
    FIELDS = {"Samples": {"cost": "double"}}  # fault


FAULTS = {
    misspelt_slot: "see_force.. is not a slot .did you mean 'see_forces'",
    misspelt_inner_slot: "has the slot 'accepted_drft', which is not in SLOTS .did you mean 'accepted_drift'",
    misspelt_variable: "see_forces.. reads 'restorng', which is not defined .did you mean 'restoring'",
    variable_of_another_slot: "see_drift.. reads 'restoring', which has no value in this slot; choose from i, g, j",
    undeclared_variable: r"changes 'peak_force', which is not declared; write `peak_force = matrix\(\)`",
    local_variable_of_the_skeleton: "sets 'u', a variable of the kernel that this slot may not change",
    local_variable_of_a_later_slot: "sets 'c', a variable of the kernel that this slot may not change",
    declared_variable_of_the_skeleton: "declares 'us', a variable of the skeleton; choose another name",
    declared_variable_of_another_part: "declares 'peak_drift', as part 'drift' does; choose another name",
    declared_constant_of_another_part: "declares 'oscillator_factors', a constant of the kernel; choose another name",
    local_variable_of_another_part: "sets 'peak_shear', which part 'base_shear' declares; choose another name",
    forbidden_change: r"sets 'drift', a variable of the kernel that this slot may not change \(it",
    forbidden_change_of_an_element: "changes 'v', a variable of the kernel that this slot may not change",
    changed_loop_variable: "sets 'j', a loop variable of the slot; choose another name",
    changed_constant: "sets 'STAGES', a constant of the kernel; choose another name",
    changed_input: "sets structures.mass, which is an input of the kernel",
    misspelt_condition: "reads 'COLAPSE', which is not defined .did you mean 'COLLAPSE'",
    unknown_field: "names output.peak_storey_force, which does not exist .did you mean 'peak_storey_drift'.*FIELDS",
    slot_on_a_line_with_others: r"calls slot\(\) in another form: write `slot\(\"name\"\)` alone on one line",
    returned_value: "has a `return` statement, which the kernel cannot contain",
    unknown_lender: "BORROWS names part 'drifts', which does not exist",
    unknown_loan: "BORROWS names 'peak_drifts', which part 'drift' does not declare",
    variable_that_this_method_lacks: "see_drift.. reads 'done', which this kernel does not have",
    variable_that_is_not_written: r"do not write output.time_of_peak_drift in a slot of the skeleton 'explicit_chain'",
}
FAULTS_OF_FIELDS = {
    other_type_of_a_field: r"Output.status has the type 'float\[\]', but 'int8\[\]' in part 'thread' .*thread.py, line",
    unknown_struct: "unknown struct 'Sample'; choose one of Control, Samples",
    unknown_type: "Samples.cost has the unknown type 'double'; write \"float\"",
}


def place_of_fault(part):
    """Return the file and the line that a message must name."""
    lines, first = inspect.getsourcelines(part)
    return __file__, next(at for at, line in enumerate(lines, first) if "# fault" in line)


def check_message(message, part, fault):
    file, line = place_of_fault(part)
    assert re.match(rf"part '{part.__name__}' \({re.escape(file)}, line {line}\): .*{fault}", message), message


@pytest.mark.parametrize("part", FAULTS, ids=lambda part: part.__name__)
def test_a_faulty_part_is_refused(part):
    with pytest.raises(ValueError, match="part") as raised:
        compose(build.SKELETONS["chain", "explicit"], PLAIN, (*registry.all_parts(), part))
    check_message(str(raised.value), part, FAULTS[part])


@pytest.mark.parametrize("part", FAULTS_OF_FIELDS, ids=lambda part: part.__name__)
def test_a_faulty_field_is_refused(part):
    with pytest.raises(ValueError, match="part") as raised:
        registry.fields((part,))
    check_message(str(raised.value), part, FAULTS_OF_FIELDS[part])


def test_a_part_may_not_set_a_variable_that_surrounds_its_slot():
    class outer(Part):
        def see_state():
            for i in range(N):
                for j in range(LANES):
                    worst = inverse_height[i, j]
                    slot("remember")
                    memory[0] = worst

    class inner(Part):
        def remember():
            worst = z[i * M, j]
            memory[0] = worst

    others = tuple(part for part in registry.all_parts() if "remember" not in bodies_of(part))
    with pytest.raises(ValueError, match=r"part 'inner' .*sets 'worst', which part 'outer' uses around this slot"):
        compose(build.SKELETONS["chain", "explicit"], PLAIN, (*others, outer, inner))


def plans():
    """Yield plans that have every part of each skeleton."""
    yield from (DENSE, replace(DENSE, method="dormand_prince54", load="harmonic_force"))
    laws = {"bilinear": "bilinear", "bouc_wen": "bouc_wen_1", "elastic": "elastic", "pinching4": "pinching4"}
    dampings = ("storey", "rayleigh", "rayleigh_tangent", "modal")
    loads = ("base_acceleration", "force_history", "harmonic_force", "kanai_tajimi")
    for method in METHODS:
        for turn, (law, variant) in enumerate(laws.items()):
            damping = "classical" if method == "exact" else dampings[turn]
            if method not in fitting_methods(forces_of(law), damping):
                continue
            rest = {"load": loads[turn], "method": method, "records_late": True}
            plan = replace(PLAIN, law=rules_of(variant), damping=damping, **rest)
            if method != "exact":
                more = {"physics": ("p_delta",), "resumes": turn == 0, "starts_displaced": turn == 1}
                plan = replace(plan, viscous_dampers="power", recorders=(*EVERY, "state"), **more)
            yield plan
            yield build.history_plan(plan)
    for method, law in (("rk4", "bouc_wen_1"), ("kutta3", "bilinear")):
        yield replace(LUMPED, method=method, law=rules_of(law), starts_displaced=True)
        yield build.history_plan(replace(LUMPED, pattern=replace(LUMPED.pattern, components=2)))
    yield replace(LUMPED, method="hht_alpha", law=rules_of("bilinear"))
    # A structure with a contact whose force depends on the rate, and with a biaxial spring.
    yield plan_of(MIXED, dynamics_of(MIXED), "rk4", "float32", is_gpu=False)
    # Equal storeys: on a GPU, several threads share a sample. stoermer evaluates the forces once per step.
    for method in ("rk4", "stoermer"):
        yield plan_of(TWISTING, dynamics_of(TWISTING), method, "float32", is_gpu=False)
        # Massless rotations of a fish-bone with hinges, and of a frame with hinges and several bays.
        for model in (reference_model(drift_capacity=0.1), hinged_frame("portal", drift_capacity=0.1)):
            hinged = wd.Scene(model, wd.Cloud([motion("pulse_1", 1)]), recorders=("spring", "residual"))
            yield plan_of(hinged, dynamics_of(hinged), method, "float32", is_gpu=False)
    # Frames with hinges on lines: one whose joints are a grid, which threads of a GPU divide, and a fish-bone. The last
    # fish-bone has elastic columns.
    for model in (grid_frame(), reference_model(), bone(2)):
        frame = wd.Scene(model, wd.Cloud([motion("pulse_1", 1)]), recorders=("spring",))
        yield plan_of(frame, dynamics_of(frame), "leapfrog", "float32", is_gpu=False)
    # Controlled structures, with all kinds of actuators, a regulator with an observer, and a controller.
    for plan in (replace(each, method="rk4", control=CONTROLLED) for each in (PLAIN, LUMPED)):
        yield plan
        yield build.history_plan(plan)
    # A kernel that checks for collapse once per group of steps.
    yield replace(PLAIN, method="stoermer", recorders=("drift",), undivided=True)


def test_all_parts_pass():
    # Without users' recorders, which other tests of this process define.
    parts, passed = tuple(part for part in registry.all_parts() if inspect.ismodule(part)), set()
    for plan in plans():
        for is_gpu in (False, True):
            is_long = is_gpu and plan.family == "chain" and not plan.undivided
            fitted = build.fitted(replace(plan, dofs=60) if is_long else plan, is_gpu)
            home = importlib.import_module(build.SKELETONS[fitted.family, fitted.kind].__module__)
            wanted = [part for part in parts if part.wanted(fitted)]
            constants = {name for each in (home, *wanted) if hasattr(each, "names") for name in each.names(fitted)}
            check_parts(home, wanted, parts, SLOTS, constants, registry.fields(()), fitted.family)
            passed |= set(wanted)
    assert passed == set(parts)


def test_the_table_has_the_slots_of_the_skeletons():
    skeletons = set(build.SKELETONS.values())
    homes = [importlib.import_module(skeleton.__module__) for skeleton in skeletons]
    bodies = [body for part in (*registry.all_parts(), *homes) for body in bodies_of(part).values()]
    assert SLOTS.keys() == set().union(*map(slots_of, [*skeletons, *bodies]))


def test_the_table_is_complete():
    for name, slot in SLOTS.items():
        assert slot.index in INDICES, name
        assert slot.text.endswith("."), name
        assert not set(slot.reads) & {*slot.writes, *COMMON, *SCRATCH}, name
