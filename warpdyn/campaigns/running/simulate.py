"""The public function that runs a scene: it checks the settings and starts the run."""

from __future__ import annotations

import collections.abc
import functools
import inspect
import os
from collections.abc import Callable
from typing import TYPE_CHECKING, ParamSpec, TypeVar

import xarray as xr

from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.reductions.statistic import Statistic
from warpdyn.campaigns.running.histories import Histories
from warpdyn.campaigns.running.outputs import Outputs
from warpdyn.campaigns.running.run import Run
from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.core.interruption import interruptible
from warpdyn.foundations.files.unfinished import STORE_SUFFIX
from warpdyn.foundations.files.zarr_stores import check_zarr
from warpdyn.model.scene.arguments import takes_scene
from warpdyn.model.scene.number_of_structures import number_of_structures, with_default_design
from warpdyn.model.scene.plausibility import warn_of_implausible
from warpdyn.model.scene.scene import Scene

if TYPE_CHECKING:
    from distributed import Client

P = ParamSpec("P")
R = TypeVar("R")
OBJECTS = {"integration": Integration, "execution": Execution, "outputs": Outputs}


def _refuses_both_forms(function: Callable[P, R]) -> Callable[P, R]:
    """Return `simulate` with a check that rejects settings given both as an object and as a single argument.

    A single argument counts as given if it is not None, even if it equals its default.
    """

    @functools.wraps(function)
    def checked(*given: P.args, **named: P.kwargs) -> R:
        for name, kind in OBJECTS.items():
            if named.get(name) is None:
                continue
            check_kind("simulate", f"wd.{kind.__name__}", named[name], kind, argument=name)
            for argument in inspect.signature(kind).parameters:
                if named.get(argument) is not None:
                    better = f"{name}=wd.{kind.__name__}({argument}={named[argument]!r}, ...)"
                    raise ValueError(f"{argument}= cannot be combined with {name}=: write {better}")
        return function(*given, **named)

    return checked


@takes_scene
@_refuses_both_forms
def simulate(
    scene: Scene,
    *,
    structures: int | None = None,
    seed: int = 0,
    integration: Integration | None = None,
    execution: Execution | None = None,
    outputs: Outputs | None = None,
    method: str | None = None,
    step: float | None = None,
    longest_step: float | None = None,
    resample: bool = False,
    dtype: str | None = None,
    tolerance: float | None = None,
    target_error: float | None = None,
    on_unstable: str = "substep",
    statistics: Statistic | collections.abc.Sequence[Statistic] | None = None,
    histories: Histories | None = None,
    keep_inputs: bool = True,
    checked_share: float | None = None,
    sample_error: float | None = None,
    path: str | os.PathLike | None = None,
    overwrite: bool = False,
    device: str | collections.abc.Sequence[str] | None = None,
    threads: int | None = None,
    memory: int | None = None,
    cluster: Client | None = None,
) -> xr.Dataset:
    """Integrate every sample of a scene (nonlinear response-history analysis) and return its recorded variables.

    The run draws structures from the scene. A sample is one structure under one motion at one level of the scene's
    design. The values of a sample depend only on the seed and on the index of the sample: they are bit-identical for
    any division of the run among blocks, threads and devices.

    Before anything is drawn or compiled, one warning lists all implausible values of the scene, such as a storey height
    in mm, with the likely mistake. To switch it off, name the quantities in the scene's `meant_as_given`.

    Settings are given as objects, or by single arguments, from which `simulate` makes these objects:
    `simulate(scene, method="rk4", device="cpu")` is the short form of
    `simulate(scene, integration=wd.Integration(method="rk4"), execution=wd.Execution(device="cpu"))`. If an object is
    given, the single arguments of its class must be absent or None.

    Args:
        scene: The scene.

        structures: Number of structures to draw; each runs under every motion, at every level, of the scene's design.
            None: as many as the scene lists (in a scatter of GivenValues, or in a design that gives each motion its own
            structures). If it lists no structures: 3 separate structures per motion for Stripes and random parameters
            (nested design), otherwise 1, with a warning if parameters are scattered. Not for a portfolio: each
            archetype has its `count`.
        seed: Seed of every random draw; the same seed gives the same samples on any device.

        integration: How samples are integrated; None: use the single arguments in the next line.
        method, step, longest_step, resample, dtype, tolerance, target_error, on_unstable: Short form of `integration`,
            such as step=0.005 [s]; `Integration` describes each of them.

        outputs: Results, and the file that they are written to; None: use the single arguments in the next line.
        statistics, histories, keep_inputs, checked_share, sample_error, path, overwrite: Short form of `outputs`, such
            as checked_share=0.1 [1] or path="run.nc"; `Outputs` describes each of them.

        execution: Where samples are integrated; None: use the single arguments in the next line.
        device, threads, memory, cluster: Short form of `execution`, such as device="cpu" or memory=2**30 [bytes];
            `Execution` describes each of them.

    Returns:
        Dataset over `sample`, with the recorded demands, the drawn inputs and `status` (ok, collapsed, diverged,
        unstable_step, not_converged). Demands are NaN if the status is diverged, unstable_step or not_converged. If
        `statistics` are given, the dataset contains only the statistics.

        EventSequence: all variables except drawn inputs also have the dimension `event` (see `select_event`). If a
        sample is not ok in an event, its demands in later events are NaN.

        Portfolio: samples are in the order of the buildings, with NaN in storeys and floors that a building does not
        have. `building` and `archetype_index` identify the building of a sample. The inputs are all parameters of the
        buildings. `estimated_relative_error` is the largest error of the groups of buildings that run together.

    Raises:
        ValueError: If an argument is out of its range, a name is unknown, or a setting is given both as an object and
            as a single argument, before anything has run; or if a drawn value is outside the bounds of its parameter,
            which may be found after some blocks have run.
        OSError: If the file cannot be written, or the path contains another run.
        RuntimeError: If workers of the cluster have other versions of warpdyn, Warp, NumPy or SciPy, or devices of
            different kinds; or if a region was given up because several workers died while they ran it.
        TypeError: If `scene` is not a Scene, or another argument is of another type.

    Example:
        >>> run = wd.simulate(scene, structures=3, seed=1)
        >>> run.sizes["sample"]  # 3 structures under 8 motions at 6 levels
        144
        >>> run["peak_storey_drift_ratio"].dims, run["peak_storey_drift_ratio"].attrs["units"]
        (('sample', 'storey'), '1')
        >>> largest = run["peak_storey_drift_ratio"].max("storey")
        >>> largest.groupby("im_level").median().astype(float).round(3).values  # at each level
        array([0.001, 0.002, 0.004, 0.007, 0.011, 0.021])
    """
    how = integration or Integration(
        method=method,
        step=step,
        longest_step=longest_step,
        resample=resample,
        dtype=dtype,
        tolerance=tolerance,
        target_error=target_error,
        on_unstable=on_unstable,
    )
    where = execution or Execution(device=device, threads=threads, memory=memory, cluster=cluster)
    what = outputs or Outputs(
        statistics=statistics,
        histories=histories,
        keep_inputs=keep_inputs,
        checked_share=checked_share,
        sample_error=sample_error,
        path=path,
        overwrite=overwrite,
    )
    _check_together(scene, how, where, what)
    scene = with_default_design(scene, structures)
    structures = number_of_structures("simulate", scene, structures)
    warn_of_implausible(scene, step=how.step, longest_step=how.longest_step)
    with interruptible():
        return Run(scene, structures, how, where, what, seed).result()


def _check_together(scene: Scene, integration: Integration, execution: Execution, outputs: Outputs) -> None:
    """Raise a ValueError if the integration, execution and output settings contradict each other or the scene."""
    path, error = outputs.path, outputs.sample_error
    if execution.cluster is not None and path is not None and not outputs.is_store and not outputs.reduced:
        raise ValueError(f"path must be a Zarr store with cluster=, as 'run{STORE_SUFFIX}', got {path!r}")
    if not scene.recorders and outputs.histories is None:
        raise ValueError(
            "the scene has no recorders, so that nothing would be kept: add recorders=(...) to the scene, or give "
            "histories="
        )
    for name, value in (("checked_share", outputs.checked_share), ("sample_error", error)):
        if value is not None and integration.resample:
            raise ValueError(
                f"{name} cannot detect the error that resample adds, because both runs use the resampled motion: "
                f"remove {name} or resample"
            )
    if error is not None and len(scene.excitation.event_names) > 1:
        raise ValueError("sample_error does not support an EventSequence: use checked_share instead")
    if outputs.is_store:
        check_zarr()
