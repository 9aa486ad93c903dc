"""Kernels composed as source text: a skeleton with slots, and the parts that a scene wants spliced into them.

A skeleton is a plain function, never called, whose text holds the course of an integration. Where a statement
`slot("name")` stands in it, the bodies of the functions `name` of all wanted parts are put, at its indentation and one
after another, before Warp sees the text. They are statements of the kernel itself: they share its local variables, and
nothing is called or copied. `slot("name", i=0)` writes 0 for the variable `i` in what is put there, and in what is put
into the slots of that: a part may hold slots too. So may the module of a skeleton hold functions for its slots.

A part is a module of one of FOLDERS. It holds

- `wanted(plan)`: whether the kernel of a plan has the part;
- a function without arguments for each slot that it has something to say in, named as the slot;
- `names(plan)`, if it needs any: constants, types and device functions that its statements name, where they depend on
  the plan. Others are found among what its module imports or defines;
- `order`, a number, where it must stand before (below 0) or after (above 0) other parts of its folder.

In a slot stand the parts of the folder that FOLDERS has first, then those of the next; within a folder they are sorted
by `order`, then by name.

Names in capitals are decided when the kernel is composed: those of `names`; for every module of FOLDERS its own name,
true if the part is wanted (P_DELTA, DRIFT); for each module of skeletons/, true if the
kernel is one of it (EXPLICIT_CHAIN); and HAS_ with the name of a slot, true if a wanted part stands there
(HAS_DASHPOT). An `if` on them, alone or beside other conditions, is settled in the text, and so is a loop over an empty
range; a `while` whose condition is then known to be true is gone through once. A name for which `names` has a string is
replaced by it.

In the end all is left out that sets a variable which nobody reads, from its declaration on, and so are loops and
branches without statements: a skeleton can read the mass of every storey, and only kernels that need it do. For this,
functions called in an assignment must have no effect but their value, unless `output` or `history` is among their
arguments.

The slots of all skeletons, and the local variables that can be named there. i counts storeys of a thread (or degrees
of freedom), j lanes; g is the storey in the building, the same as i but where threads share a sample. `h[j]` is the
step of lane j, 0 once it is done; `u[i, j]`, `v[i, j]`, `z[i * M + m, j]` are the accepted state, `us[i, j]`,
`vs[i, j]` the one that is tried. The propagated skeleton steps through modes and has neither: in its slots a state is
`drift`, `vi`, `ai` and `restoring`.

    declare                variables, before all else: `row()` has a value for each lane, `matrix()` one for each storey
                           and lane, `indices()` a whole number for each lane
    place                  of which storeys of which samples a thread is
    read_lane              lane j takes its sample
    read_sample            of lane j and its structure s; the same with read_storey, read_entry (of full matrices, in
                           row i and column k) and start_row
    number_storey          sets g
    fill_pad, leave_pad    storeys that only fill a section up
    exchange_states        all is read; threads that share a sample exchange it
    start_storey           of storey i and lane j, before the first step; start_drift the same, with `drift`
    start                  before the first interval

Every interval:

    begin_phase            before the intervals from `interval_from` on, of a sample alone in its thread; may end them
                           at `interval_until`, after which others begin; end_steps after the last,
                           see_last once its state is seen
    begin_interval         before anything of it is known
    stop_lane              of lane j: may set its step to 0
    settle_lane            of lane j: `h[j]` is settled, unless an adaptive method divides it
    in_interval            what loads have at its start, and their change over it; value_of_interval the same of lanes
                           whose motions end apart

Every step, with `index` from the first one on and `substep` from the interval's start:

    begin_step, end_step   with the accepted state
    restart_recorders      of lane j, in a part of begin_step: peaks count from the accepted state on
    begin_attempt, end_attempt   of an explicit method's stages, through which an adaptive method goes until lanes agree
    end_part               of a chain, after an attempt: with the accepted state
    save, restore_saved    of lane j: what an attempt that fails must not leave behind
    miss_turns             of storey i and lane j: what an error estimate does not see
    position_of_stage      sets `at`, the stage's time from the start of the interval, over its length
    begin_stage, end_stage around a stage, `stage` counts them; end_stages after the last
    begin_search           of lane j, before an implicit method looks for the state at the step's end;
                           begin_search_of_storey the same of storey i, end_search once it is over
    damp_modes             the forces of modal damping, of `vs`

Every walk through the storeys, from the top down:

    begin_walk             of lane j
    visit_storey           of storey i, all that a stage of an explicit method does
    before_storey, after_storey   storey i, before and after its lanes
    state_of_stage         sets `drift` and `vi` of storey i and lane j; state_below takes those of the storey below off
                           `drift` and `rate`, memory_of_stage sets `memory`
    accepted_drift, storey_coefficients, accepted_memory   set `drift`, `c` and `memory` as the accepted state has them;
                           reached_drift sets `reached_drift[j]`, with `u=us` as a stage has it
    follow_rules           sets `after`, the memory at `reached_drift[j]` by all rules of the law
    restore                sets `f`, the law's force, where it is no function of the memory as it stands; with an
                           implicit method `stiffness` too, its slope
    add_to_force           of what else is a force of the drift
    tangent_ahead          sets `tangent`, the storey's stiffness as it goes on from `drift`
    add_to_dashpot         the first part there sets `dashpot`, others add to it: what is viscous in the storey
    add_to_foot, restore_foot   the same of the section's lowest storey, whose force the section below needs
    add_to_net, add_load   of dampers to the ground and loads, to `net`: the force on the floor
    add_to_acceleration    of dampers to the ground in proportion to mass, to `ai`
    see_forces             the accepted state: `restoring`, the law's force, and `ai` of the floor, absolute
    before_force_ends      of a force history, in see_forces: sets `before_end`, the acceleration with the history's
                           last force, at the instant of its last sample; else `ai`
    begin_floor, add_mode_to_floor   of modes: before the accelerations of a floor are summed up, and mode m of lane j
    see_drift              the accepted state: `drift`
    see_state              all storeys have been seen
    add_base               takes the base's acceleration off `ai`; add_base_to_net off `net`
    add_powers             of storey i and lane j: the powers of its forces
    sum_up_slopes          of chains: adds this stage's slopes to those before, and goes on to the next stage's state
    end_storey             `vi` and `ai` are known
    add_to_stiffness, add_to_storey, add_to_imbalance, eliminate, follow_slope   of an implicit method's system
    judge_walk, substitute, choose_change   whether the state is found, and the next one to try
    settle_storey          of storey i and lane j: the step is accepted, the memory is still that of before

Collapses, in the part that tells them:

    watch_drifts           of an accepted state: whether a storey passes its capacity
    watch_lanes, collapse_here   of lanes that wait for others: whether they collapse; of lane j, that it does
    find_first_to_pass     of lane j: which storey is the first to pass, and after which share of the step;
                           compare_sections the same among threads that share a sample
    see_drifts_at_collapse   of lane j: adds the drifts at that instant to the peaks

Energies, in parts of the recorder that sums them up:

    add_to_initial_energy, remember   of what an event starts with
    add_supply, add_supply_of_walk, add_supply_of_entry   of loads, to `power_in[j]`
    add_loss               of dampings beside `dashpot`, to `power_viscous[j]`
    add_supply_at_state    of loads, to `energy_in[j]`, where energies are sums over the states of an implicit method,
                           each of the weight `weight` (trapezoidal rule); add_loss_at_state of dampings beside
                           `dashpot`, to `energy_viscous[j]`
    keep_end_of_step       of what the next step must know of a load
    add_to_supplied        of what else was supplied, at the end
    see_products           of full matrices: all products are known; see_mode, see_modes: those of a mode, and of all

At the end of a run, of lane j:

    finish                 `o` is the sample's column of the outputs
    finish_storey          of storey i: writes outputs; finish_drift the same, with `drift`, `memory` and `c`
    add_to_means           of means over the end of a run
    after_finish           what was summed up over storeys
    judge_demand, judge_state, judge_step   set `status`; what comes later overrides what came before
    write                  outputs of samples
"""

import ast
import functools
import hashlib
import linecache
import sys
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType
from typing import Any, NamedTuple

import warp as wp

from warpdyn.engine.kernels.registry import all_parts, names_in
from warpdyn.engine.kernels.source_text import (
    Pairs,
    bodies_of,
    folded,
    names_of,
    source_of,
    spliced,
    without_unread,
)


class Composed(NamedTuple):
    """The text of a kernel, and the constants, types and functions that it names."""

    text: str
    names: dict[str, Any]


def compose(skeleton: Callable, plan: Any, parts: Sequence[Any] | None = None) -> Composed:
    """Return the kernel of a plan: a skeleton with the wanted ones of some parts (all there are) in its slots."""
    parts = all_parts() if parts is None else parts
    wanted = [part for part in parts if part.wanted(plan)]
    home = sys.modules[skeleton.__module__]
    values: dict[str, Any] = {_name(part).upper(): part in wanted for part in parts}
    values |= {name.upper(): name == _name(home) for name in names_in("skeletons")}
    for each in (home, *wanted):
        if hasattr(each, "names"):
            _add(values, each.names(plan))
    filled = {slot for part in wanted for slot in bodies_of(part)}
    values |= {f"HAS_{slot.upper()}": slot in filled for slot in set().union(*map(bodies_of, parts))}
    known = {name: value for name, value in values.items() if name.isupper() and isinstance(value, bool | int)}
    written = {name: value for name, value in values.items() if isinstance(value, str)}
    text, named = _text(skeleton, (home, *wanted), tuple(known.items()), tuple(written.items()))
    of_modules: dict[str, Any] = {}
    for each in (home, *wanted):
        held = vars(each if isinstance(each, ModuleType) else sys.modules[each.__module__])
        bodies = bodies_of(each)
        _add(of_modules, {name: held[name] for name in named & held.keys() - values.keys() - bodies.keys()})
    return Composed(text, {name: value for name, value in (of_modules | values).items() if name in named})


@functools.cache  # plans that differ in their types alone have one text
def _text(
    skeleton: Callable,
    holders: tuple[Any, ...],
    known: tuple[tuple[str, Any], ...],
    written: Pairs,
) -> tuple[str, frozenset[str]]:
    """Return the text of a kernel whose slots modules and parts fill, and the names in it."""
    text = spliced(source_of(skeleton), holders, written)
    text = without_unread(folded(text, dict(known)))
    return text, frozenset(name.id for name in names_of(ast.parse(text)))


def kernel_of(
    composed: Composed, options: Mapping[str, Any], threads_of_block: int | None = None, *, is_lean: bool = False
) -> wp.Kernel:
    """Return the kernel that a text describes, in a module with these options.

    Args:
        composed: The text, and what it names.
        options: Options of the module.
        threads_of_block: Threads of a block that a GPU's compiler is told of; None for none.
        is_lean: Whether a GPU's thread takes one row of a launch, without Warp's loop over further ones.
    """
    digest = hashlib.sha256(composed.text.encode()).hexdigest()[:16]
    name = composed.text.partition("(")[0].removeprefix("def ")
    file = f"<{name} {digest}>"
    # Where tracebacks, inspect and warp look sources up; without a time of change it is never looked for on disk.
    linecache.cache[file] = (len(composed.text), None, composed.text.splitlines(keepends=True), file)
    namespace = {"wp": wp, **composed.names, "__name__": __name__}
    exec(compile(composed.text, file, "exec"), namespace)
    return wp.kernel(
        namespace[name],
        module="unique",
        enable_backward=False,
        module_options=dict(options),
        launch_bounds=threads_of_block,
        grid_stride=False if is_lean else None,
    )


def _name(part: Any) -> str:
    return part.__name__.rpartition(".")[2]


def _add(values: dict[str, Any], more: Mapping[str, Any]) -> None:
    """Add named values to others, which none may contradict."""
    for name, value in more.items():
        if name in values and values[name] is not value and values[name] != value:
            raise ValueError(f"parts of a kernel disagree on {name}: {values[name]!r} and {value!r}")
        values[name] = value
