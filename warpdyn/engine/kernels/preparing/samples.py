"""Kernels that choose the integration steps of samples, and the order in which the samples are launched.

A sample is a structure under one motion. A motion consists of intervals (time between two values), and each interval is
divided into integration steps (substeps).
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import warp as wp

from warpdyn.engine.device.processor import small_options
from warpdyn.engine.kernels.plan import DTYPES, structs
from warpdyn.engine.kernels.preparing.text import INTEGERS, REALS, TABLE, PreparingKernel, launch
from warpdyn.engine.tracing.nodes import Node
from warpdyn.engine.tracing.program import Program

# Indices of the counts of a block (group of samples): structures or samples that the host must refuse, samples beyond
# the stability limit, the first of these samples, samples with a step that is too long, the longest duration, and
# whether the steps of a sample were divided. From STARTS on follows, for each number of substeps, the position of its
# first sample in the order of the launch, or -1 if no sample has this number of substeps.
REFUSED, UNSTABLE, FIRST_UNSTABLE, LONG, LONGEST_RUN, IS_DIVIDED, STARTS = range(7)
MOST_SUBSTEPS = 2**12  # samples with more steps in an interval are prepared by the host
COUNTS = STARTS + MOST_SUBSTEPS
# Where the motions of samples are listed: one value for each sample; one list for the samples of one structure, which
# all structures share; or tables for sites and earthquakes.
LISTED, SAME_FOR_ALL, AT_SITES = range(3)
# Indices of the extreme values of a block, in addition to the extreme values of its structures.
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
    """Quantities that are computed for each sample from the periods of its structure and the time grid of its motion.

    Args:
        fields: Quantities for the fields of the struct Samples: {field: node of the recorded computation}.
        substeps: Number of steps in an interval of the motion.
        is_long: Whether the step is too long to be accurate, and is not divided.
        longest: Longest accurate step [s].
        is_unstable: Whether the step was beyond the stability limit.
        factor: Factor by which the number of steps in an interval was multiplied because the step was unstable.
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
    """Chooses the integration steps of samples on a device, and the order of their launch.

    Args:
        values: Quantities that are computed for each sample.
        dtype: Number type of the kernels that integrate the samples.
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
        """The kernels that compute the steps of samples and sort the samples."""
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
        """Queue the kernel that computes steps and arguments of samples, on the present stream of the arrays' device.

        Args:
            count: Number of samples.
            design: Motion, scale and time grid of the samples.
            vibration: Period [s], slowest decay [1/s] and stable step [s] of the structures, shape [3, structure].
            samples: Output: struct Samples.
            steps: Output: arrays for the number of substeps, and for the steps [s] in float64, shape [sample].
            counts, extremes: Output: arrays for the counts and the extreme values of the block.
        """
        device = str(vibration.device)
        inputs = [count, *design.arguments, vibration, *self._kernel.arguments(device)]
        outputs = [samples, *steps, counts, extremes]
        launch(self._kernel.kernel, count, [*inputs, *outputs], device)


class Design(NamedTuple):
    """Motion, scale and time grid of samples, as arguments of the kernels; arrays are in the memory of a device.

    Args:
        per_structure: Number of samples per structure.
        is_single: Whether all samples have the same structure.
        kind: LISTED, SAME_FOR_ALL or AT_SITES.
        site: For AT_SITES: index of the site of each structure and draw, shape [structure, draw].
        offset: For AT_SITES: position of each sample of a structure among the values of a site.
        stride: Number of values per site.
        motion, scale: Indices of the motions and factors on them; `kind` decides the order.
        interval, substeps, intervals: Time grid of each motion: interval [s], steps per interval, number of intervals.
        tie: For each value of `motion`, the number by which samples of equal duration are sorted.
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
        """The first arguments of the kernel `prepare_samples`: all fields except `tie`."""
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


@wp.kernel(module="unique", enable_backward=False, module_options=small_options())
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
    """Write a sorting key for each sample.

    Samples with few substeps come first; among samples with the same number of substeps, the longest comes first; among
    samples of the same duration, the sample with the least value of `tie`.
    """
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


@wp.kernel(module="unique", enable_backward=False, module_options=small_options())
def starts_of_groups(count: int, keys: wp.array(dtype=wp.int64), counts: wp.array(dtype=wp.int32)):
    """Write, for each number of substeps, the position of its first sample in the sorted order to `counts`."""
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

    Samples with the same number of substeps follow each other; the position of the first of them is written to
    `counts`.

    Args:
        count: Number of samples.
        design: Motion, scale and time grid of the samples.
        run_intervals, taken, counts: Results of `SamplePreparation.prepare`.
        keys: Memory for 2 `count` keys.
        order: Memory for 2 `count` numbers; the first half is the result.
        has_ties: Whether samples of equal duration are sorted by `design.tie`.
    """
    device = str(keys.device)
    entries = [design.per_structure, design.kind, design.site, design.offset, design.stride]
    launch(sorting_keys, count, [count, *entries, run_intervals, taken, counts, design.tie, keys, order], device)
    begin = 0 if has_ties else TIE_BITS
    wp.utils.radix_sort_pairs(keys, order, count, begin, TIE_BITS + DURATION_BITS + MOST_SUBSTEPS.bit_length())
    launch(starts_of_groups, count, [count, keys, counts], device)
