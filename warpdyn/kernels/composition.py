"""Kernels composed as source text: a skeleton with slots, and the parts that a scene wants spliced into them.

A skeleton is a plain function, never called, whose text holds the course of an integration. Where a statement
`slot("name")` stands in it, the bodies of the functions `name` of all wanted parts are put, at its indentation and one
after another, before Warp sees the text. They are statements of the kernel itself: they share its local variables, and
nothing is called or copied. `slot("name", i=0)` writes 0 for the variable `i` in what is put there. A part may hold
slots too.

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

The slots of all skeletons, and the local variables that can be named there:

declare         variables of the part, before all else. `row()` holds a value for each lane, `matrix()` one for each
                storey (or degree of freedom) and lane, `indices()` a whole number for each lane.
read_sample     of lane j: structure s, `sample[j]`, `motion[j]`, `scale[j]`, `step[j]`, `live_intervals[j]`
read_storey     of storey i (storey g of the building) and lane j: `mass[i, j]`, `inverse_mass[i, j]`,
                `inverse_height[i, j]`, and the initial state `u[i, j]`, `v[i, j]`, `z[i * M + m, j]`
start_storey    of storey i and lane j: all is read; `drift`, and of laws the memory `memory` and coefficients `c`
start           all is read, before the first interval
begin_interval  before the lanes' steps `h[j]` are set; `interval`
settle_lane     of lane j: `h[j]` is the step, 0 for a lane that is done
in_interval     after that; what a load has at the interval's start, and its change over it
begin_step      `index` counts steps, `substep` those of the interval
begin_attempt, end_attempt   around the stages of a step, which an adaptive method goes through several times
begin_stage     of the stage `stage`, with the state `us[i, j]`, `vs[i, j]`: what loads and dampings have there
begin_walk      before the storeys are gone through from the top down: what is summed up over them starts anew
before_storey   storey i, before its lanes are gone through
add_to_force    of storey i and lane j, as those below: `drift`, `rate`, `restoring`; adds to the storey's force `f`
add_to_dashpot  adds to `dashpot`, the force of what is viscous in the storey
add_to_net      adds to `net`, the force on the floor
add_to_acceleration   adds to `ai`, the floor's acceleration
see_drift       the accepted state, seen once a step: `drift`, `rate`, `i`, `j`
see_forces      the accepted state, with the forces there: `restoring`, `f`, and `ai`, the floor's absolute acceleration
keep_history    the same, and `ui`, `vi`
add_base        `ai` becomes relative to the base
add_powers      the powers of the forces in the storey
end_storey      the storey's slopes are known: `vi`, `ai`
after_storey    storey i, after its lanes have been gone through
see_state       after the walk at an accepted state: what was collected over the storeys
end_stage       after the walk
end_step        the step is accepted: `u[i, j]`, `v[i, j]`, `z[i * M + m, j]`
finish          of lane j, once the run has ended: `o`, its column of the outputs
finish_storey   of storey i (g) and lane j: outputs of storeys
finish_drift    the same, with `drift`, `memory` and `c`
after_finish    of lane j: what was summed up over the storeys
judge           of lane j: sets `status`
write           of lane j: outputs of samples
"""

import ast
import hashlib
import linecache
import sys
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType
from typing import Any, NamedTuple

import warp as wp

from warpdyn.kernels.registry import all_parts, names_in
from warpdyn.kernels.source_text import bodies_of, folded, source_of, spliced, with_names, without_unread


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
    text = with_names(spliced(source_of(skeleton), wanted), written)
    text = without_unread(folded(text, known))
    named = {node.id for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Name)}
    of_modules: dict[str, Any] = {}
    for each in (home, *wanted):
        held = vars(each if isinstance(each, ModuleType) else sys.modules[each.__module__])
        bodies = bodies_of(each)
        _add(of_modules, {name: held[name] for name in named & held.keys() - values.keys() - bodies.keys()})
    return Composed(text, {name: value for name, value in (of_modules | values).items() if name in named})


def kernel_of(composed: Composed, options: Mapping[str, Any]) -> wp.Kernel:
    """Return the kernel that a text describes, in a module with these options."""
    digest = hashlib.sha256(composed.text.encode()).hexdigest()[:16]
    name = next(node.name for node in ast.parse(composed.text).body)
    file = f"<{name} {digest}>"
    # Where tracebacks, inspect and warp look sources up; without a time of change it is never looked for on disk.
    linecache.cache[file] = (len(composed.text), None, composed.text.splitlines(keepends=True), file)
    namespace = {"wp": wp, **composed.names, "__name__": __name__}
    exec(compile(composed.text, file, "exec"), namespace)
    return wp.kernel(namespace[name], module="unique", enable_backward=False, module_options=dict(options))


def _name(part: Any) -> str:
    return part.__name__.rpartition(".")[2]


def _add(values: dict[str, Any], more: Mapping[str, Any]) -> None:
    """Add named values to others, which none may contradict."""
    for name, value in more.items():
        if name in values and values[name] is not value and values[name] != value:
            raise ValueError(f"parts of a kernel disagree on {name}: {values[name]!r} and {value!r}")
        values[name] = value
