"""The kernels that choose the steps of samples and the order in which they are launched."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import warp as wp

from warpdyn.engine.kernels.plan import DTYPES, structs
from warpdyn.engine.kernels.preparing.text import INTEGERS, REALS, TABLE, PreparingKernel, launch
from warpdyn.engine.tracing.nodes import Node
from warpdyn.engine.tracing.program import Program

# Counts of a block: structures or samples that the host must refuse, samples beyond the stability limit, the first of
# them, samples with a step that is too long, the longest duration, and whether the steps of a sample were divided. For
# each number of substeps the place of its first sample in the order of the launch follows, or -1 if no sample has it.
REFUSED, UNSTABLE, FIRST_UNSTABLE, LONG, LONGEST_RUN, IS_DIVIDED, STARTS = range(7)
MOST_SUBSTEPS = 2**12  # samples with more steps in an interval are prepared by the host
COUNTS = STARTS + MOST_SUBSTEPS
# Where the motions of samples are: in lists with a value for each sample; in lists for the samples of one structure,
# which are those of all structures; or in tables for sites and earthquakes.
LISTED, SAME_FOR_ALL, AT_SITES = range(3)
# Extremes of a block, in addition to those of its structures.
LARGEST_FACTOR, LEAST_ACCURATE_STEP, EXTREMES = 2, 3, 4
DURATION_BITS, TIE_BITS = 16, 32

HEAD = """\
    k = wp.tid()
    if k >= count:
        return
    s = wp.where(is_single, 0, k / per_structure)
    p = entry_of(k, per_structure, kind, site, offset, stride)
    m = motion[p]
    interval = interval_of[m]
    substeps = wp.float64(substeps_of[m])
    intervals = wp.float64(intervals_of[m])
"""
ARGUMENTS = {
    "count": "int",
    "per_structure": "int",
    "is_single": "bool",
    "kind": "int",
    "site": "wp.array2d(dtype=wp.int32)",
    "offset": INTEGERS,
    "stride": "int",
    "motion": INTEGERS,
    "scale": REALS,
    "interval_of": REALS,
    "substeps_of": INTEGERS,
    "intervals_of": INTEGERS,
    "vibration": TABLE,
}
OUTPUTS = {"samples": "Samples", "taken": INTEGERS, "step": REALS, "counts": INTEGERS, "extremes": REALS}


class SampleValues(NamedTuple):
    """Values that are computed for each sample, from the vibration of its structure and the time grid of its motion.

    Args:
        fields: Values of fields of the kernels' struct.
        substeps: Steps in an interval of the motion.
        is_long: Whether the step is too long to be accurate, and is not divided.
        longest: Longest accurate step [s].
        is_unstable: Whether the step was beyond the stability limit.
        factor: Factor by which the steps in an interval were multiplied because of it.
        refused: Whether no step is stable, or there are too many steps.
    """

    fields: Mapping[str, Node]
    substeps: Node
    is_long: Node
    longest: Node
    is_unstable: Node
    factor: Node
    refused: Node


class SamplePreparation:
    """Chooses the steps of samples on a device, and their order.

    Args:
        values: Values that are computed for each sample.
        dtype: Number type of the kernels of histories.
    """

    def __init__(self, values: SampleValues, dtype: str) -> None:
        self.fields = [*values.fields, "structure", "motion", "scale"]
        program, struct = Program(), structs(dtype).Samples
        for name, node in values.fields.items():
            kind = "int" if struct.vars[name].type.dtype is wp.int32 else "dtype"
            text = program.name_of(node)
            program.add(f"samples.{name}[k] = {kind}({text})")
        text = program.name_of(values.fields["step"])
        program.add(f"step[k] = {text}")
        program.add("samples.structure[k] = s")
        program.add("samples.motion[k] = m")
        program.add("samples.scale[k] = dtype(scale[p])")
        substeps, long, longest, unstable, factor, refused = program.names_of(
            [values.substeps, values.is_long, values.longest, values.is_unstable, values.factor, values.refused]
        )
        # Few samples count, and atomic operations on one address wait for each other.
        for line in f"""\
own = int(wp.min({substeps}, wp.float64({MOST_SUBSTEPS})))
taken[k] = own
if own != int(substeps):
    counts[{IS_DIVIDED}] = 1
if {refused} or own >= {MOST_SUBSTEPS}:
    wp.atomic_add(counts, {REFUSED}, 1)
if {unstable}:
    wp.atomic_add(counts, {UNSTABLE}, 1)
    wp.atomic_min(counts, {FIRST_UNSTABLE}, k)
    wp.atomic_max(extremes, {LARGEST_FACTOR}, {factor})
if {long}:
    wp.atomic_add(counts, {LONG}, 1)
    wp.atomic_min(extremes, {LEAST_ACCURATE_STEP}, {longest})
if samples.run_intervals[k] > counts[{LONGEST_RUN}]:
    wp.atomic_max(counts, {LONGEST_RUN}, samples.run_intervals[k])""".splitlines():
            program.add(line)
        names = {"dtype": DTYPES[dtype], "Samples": struct, "entry_of": entry_of}
        self._kernel = PreparingKernel("prepare_samples", HEAD, (ARGUMENTS, OUTPUTS), "", program, names)

    @property
    def kernels(self) -> list[wp.Kernel]:
        """The kernels that prepare and sort samples."""
        return [self._kernel.kernel, sorting_keys, starts_of_groups]

    def prepare(
        self,
        count: int,
        design: "Design",
        vibration: Any,
        samples: Any,
        steps: tuple[Any, Any],
        counts: Any,
        extremes: Any,
    ) -> None:
        """Queue the kernel on the present stream of the device of the arrays.

        Args:
            count: Number of samples.
            design: Motion, scale and time grid of the samples.
            vibration: Array of the vibration of the structures, shape [3, structure].
            samples: Struct of the samples.
            steps: Arrays for the substeps, and for the steps in float64.
            counts, extremes: Arrays for counts and extremes.
        """
        device = str(vibration.device)
        inputs = [count, *design.arguments, vibration, *self._kernel.arguments(device)]
        outputs = [samples, *steps, counts, extremes]
        launch(self._kernel.kernel, count, [*inputs, *outputs], device)


class Design(NamedTuple):
    """Motion, scale and time grid of samples, as arguments of the kernels; arrays in the memory of a device.

    Args:
        per_structure: Number of samples of a structure.
        is_single: Whether all samples have one structure.
        kind: LISTED, SAME_FOR_ALL or AT_SITES.
        site: Site of each structure and draw, shape [structure, draw]; for AT_SITES.
        offset: Place of each sample of a structure among the values of a site; for AT_SITES.
        stride: Number of values of a site.
        motion, scale: Motions and scales.
        interval, substeps, intervals: Time grid of each motion.
        tie: Number by which samples of equal duration are sorted, for each value of `motion`.
    """

    per_structure: int
    is_single: bool
    kind: int
    site: Any
    offset: Any
    stride: int
    motion: Any
    scale: Any
    interval: Any
    substeps: Any
    intervals: Any
    tie: Any

    @property
    def arguments(self) -> tuple[Any, ...]:
        """The arguments of `prepare_samples`."""
        return self[:-1]


@wp.func
def entry_of(
    k: int,
    per_structure: int,
    kind: int,
    site: wp.array2d(dtype=wp.int32),
    offset: wp.array(dtype=wp.int32),
    stride: int,
):
    structure = k / per_structure
    j = k - structure * per_structure
    entry = k
    if kind == wp.static(SAME_FOR_ALL):
        entry = j
    if kind == wp.static(AT_SITES):
        entry = site[structure, j * site.shape[1] / per_structure] * stride + offset[j]
    return entry


@wp.kernel(module="unique", enable_backward=False)
def sorting_keys(
    count: int,
    per_structure: int,
    kind: int,
    site: wp.array2d(dtype=wp.int32),
    offset: wp.array(dtype=wp.int32),
    stride: int,
    run_intervals: wp.array(dtype=wp.int32),
    taken: wp.array(dtype=wp.int32),
    counts: wp.array(dtype=wp.int32),
    tie: wp.array(dtype=wp.uint32),
    keys: wp.array(dtype=wp.int64),
    order: wp.array(dtype=wp.int32),
):
    """Write a key for each sample: samples with few substeps first, then the longest, then the least ties."""
    k = wp.tid()
    if k >= count:
        return
    longest = counts[LONGEST_RUN]
    coarser = int(0)
    while (longest >> coarser) >= 65536:
        coarser += 1
    duration = wp.int64((longest - run_intervals[k]) >> coarser)
    p = entry_of(k, per_structure, kind, site, offset, stride)
    first = (wp.int64(taken[k]) << wp.int64(16)) | duration
    keys[k] = (first << wp.int64(32)) | wp.int64(tie[p])
    order[k] = k


@wp.kernel(module="unique", enable_backward=False)
def starts_of_groups(count: int, keys: wp.array(dtype=wp.int64), counts: wp.array(dtype=wp.int32)):
    """Write the place of the first sample with each number of substeps, from sorted keys."""
    k = wp.tid()
    if k >= count:
        return
    substeps = int(keys[k] >> wp.int64(48))
    before = int(-1)
    if k > 0:
        before = int(keys[k - 1] >> wp.int64(48))
    if substeps != before:
        counts[wp.static(STARTS) + wp.min(substeps, wp.static(MOST_SUBSTEPS - 1))] = k


def sort_samples(
    count: int,
    design: Design,
    run_intervals: Any,
    taken: Any,
    counts: Any,
    keys: Any,
    order: Any,
    *,
    has_ties: bool,
) -> None:
    """Queue the sorting of samples on the present stream: `order` becomes the order of their launch.

    The starts of the groups of samples with the same number of substeps are added to the counts.

    Args:
        count: Number of samples.
        design: Motion, scale and time grid of the samples.
        run_intervals, taken, counts: Results of `SamplePreparation.prepare`.
        keys: Memory of 2 `count` keys.
        order: Memory of 2 `count` numbers; the first half is the result.
        has_ties: Whether samples of equal duration are sorted by `design.tie`.
    """
    device = str(keys.device)
    entries = [design.per_structure, design.kind, design.site, design.offset, design.stride]
    launch(sorting_keys, count, [count, *entries, run_intervals, taken, counts, design.tie, keys, order], device)
    begin = 0 if has_ties else TIE_BITS
    wp.utils.radix_sort_pairs(keys, order, count, begin, TIE_BITS + DURATION_BITS + MOST_SUBSTEPS.bit_length())
    launch(starts_of_groups, count, [count, keys, counts], device)
