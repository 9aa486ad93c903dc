"""The public function that runs a scene: it checks the arguments and passes them on in three parts."""

from __future__ import annotations

import collections.abc
import os
from typing import TYPE_CHECKING

import xarray as xr

from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.reductions.statistic import Statistic
from warpdyn.campaigns.running.histories import Histories
from warpdyn.campaigns.running.outputs import Outputs
from warpdyn.campaigns.running.run import Run
from warpdyn.foundations.core.interruption import interruptible
from warpdyn.foundations.files.unfinished import STORE_SUFFIX
from warpdyn.foundations.files.zarr_stores import check_zarr
from warpdyn.model.scene.arguments import takes_scene
from warpdyn.model.scene.number_of_structures import number_of_structures
from warpdyn.model.scene.plausibility import warn_of_implausible
from warpdyn.model.scene.scene import Scene

if TYPE_CHECKING:
    from distributed import Client


@takes_scene
def simulate(
    scene: Scene,
    *,
    structures: int | None = None,
    seed: int = 0,
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
    """Integrate every sample of a scene and return what it records.

    Structures are drawn, and each of them under each motion (and level) of the scene's design is a sample. A sample's
    values depend on the seed and its own index alone: no division among blocks, threads and devices changes a bit.

    Before anything is drawn or compiled, one warning names all that is implausible in the scene, such as a storey
    height in mm, with the likely mistake; `meant_as_given` switches it off by the quantities' names.

    Args:
        scene: The scene.

        structures: Number of structures to draw; each runs under every motion, at every level, of the scene's design.
            None for as many as the scene lists (in a scatter of GivenValues, or in a design that gives each motion
            structures of its own), and for one if it lists none, with a warning if parameters are scattered. Leave it
            out for a portfolio: each archetype has its `count`.
        seed: Seed of every random draw; the same seed gives the same samples on any device.

        method: Integration method, a row of METHODS; None for the choice made for `target_error`, and otherwise, where
            no step is given, for the cheapest on the device that is measured to err hardly more than "rk4" at its
            default step in storeys of the scene's laws, such as "velocity_verlet" in two steps for one; else for "rk4".
            The attributes `method` and `method_chosen_because` say which and why.
        step: Integration step [s], which must divide the step of every motion; None to choose one for each motion.
        longest_step: Upper bound of the chosen steps [s], in place of the default rule.
        resample: Whether a motion whose step is no multiple of `step` is resampled at `step`, which cuts its corners.
        dtype: "float32" or "float64"; None for "float32", or the choice made for `target_error`.
        tolerance: Relative error [1] that an adaptive method allows itself in a step (1e-6 by default); its steps are
            no longer than those of other methods.
        target_error: Relative error [1] that the peak drifts of 95 % of the samples stay below; `plan` chooses the step
            for it, and method and dtype if they are not given. None for no such choice.
        on_unstable: What is done where the step is beyond a structure's stability limit: "substep" (these samples take
            the fewest stable steps in each interval of the record), "raise" (an error before any sample runs), or
            "flag" (status unstable_step). Where a step proves too long only during the run, "substep" runs the sample
            again at shorter ones, as far as that costs no more than twice the run; the others never do.

        statistics: Statistics that the samples are reduced to as they finish, one or a list: DamageCounts,
            DemandMoments, DemandHistogram, LargestDemand or DamageLoss. The dataset then holds these alone, and no
            `sample`: inputs and demands of single samples are not kept, and neither `histories` nor `sample_error` goes
            with it. With `path` a run that was stopped or killed goes on from the regions that it had counted, each
            half a minute's work at most. None to keep the samples.
        histories: Samples whose whole histories are kept; None for none. An EventSequence and a portfolio have
            none.
        keep_inputs: Whether the drawn parameters of each sample are part of the dataset.
        checked_share: Share of the samples [1] (at least 30 of them) that are run again at half the step and in
            float64, to estimate the relative error of every demand; None for none.
        sample_error: Relative error [1] asked for of every sample, such as 0.05; None for no estimate. Every sample is
            run twice more: at half the step in float64, for `estimated_relative_error_of_sample`, and under its motion
            scaled by 1.001, for the flag `sensitive`: whether its peaks then change by more than this error and .001,
            as it does near a bifurcation, where no step settles them. A warning counts both. It costs some three to six
            times the run; an EventSequence has none.
        path: NetCDF file (run.nc) or Zarr store (run.zarr) to write the samples to, block by block. It appears when the
            run has finished; a file of the same run that was there before remains until then. A run that was stopped or
            killed, or whose disk was full, resumes from its finished blocks when the same call is made again, and the
            results have the same bits. These blocks are in a hidden folder beside the file, and take as much room as
            the demands; their checksums are verified. During the run of a portfolio, files of its groups are there,
            too. The returned dataset reads values from the file when they are asked for: close it when done. None to
            return the dataset in memory.
        overwrite: Whether a run of another scene, seed or arguments that stands at `path` is replaced.

        device: "cpu" or "cuda:0"; several GPUs as ["cuda:0", "cuda:1"], or "cuda" for all there are, which share the
            samples; None for the first GPU, or the CPU where there is none.
        threads: CPU threads; None for every core this process may use.
        memory: Bytes that the blocks in progress may take on the host, and on each device; None for a share of the free
            memory. `histories` must fit in it, too. A dataset that is returned in memory is not counted.
        cluster: Client of a `dask.distributed` cluster whose workers run the samples, region by region; None to run
            them here. `path` is a Zarr store then, on a disk that all workers share, or None; with `statistics` it may
            be any file of this process. `device`, `threads` and
            `memory` are of each worker: its first GPU and its own number of threads by default. Results have the same
            bits as here. A worker that dies costs the regions that it was running, and the same call goes on from the
            regions that are in the store. It needs
            pip install "distributed>=2024.11" "zarr>=3.1.3".

    Returns:
        Dataset over `sample`, with the demands recorded, the inputs drawn and `status` (ok, collapsed, diverged,
        unstable_step, not_converged). Demands of the last three are NaN. All variables of an EventSequence but its
        drawn inputs also lie along `event` (see `select_event`); a sample that is not ok in an event has no demands in
        later ones. Samples of a Portfolio are in the order of its buildings, NaN in storeys and floors that a building
        does not have; `building` and `archetype_index` say which building a sample is of; the inputs are all
        parameters of the buildings, and `estimated_relative_error` is the largest of the groups that are run together.

    Raises:
        ValueError: If an argument is out of its range or a name is unknown, before anything has run; or if a drawn
            value is out of its parameter's bounds, which may come after some blocks have run.
        OSError: If the file cannot be written, or another run stands there.
        RuntimeError: If workers of the cluster have other versions of warpdyn, Warp, NumPy or SciPy, or devices of
            different kinds; or if a region was given up because several workers died that ran it.
        TypeError: If the scene is none, or `statistics`, `histories` or `cluster` is of another kind.

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
    integration = Integration.from_arguments(
        method=method,
        dtype=dtype,
        step=step,
        longest_step=longest_step,
        resample=resample,
        tolerance=tolerance,
        target_error=target_error,
        on_unstable=on_unstable,
    )
    execution = Execution(device=device, threads=threads, memory=memory, cluster=cluster)
    outputs = Outputs(
        statistics=statistics,
        histories=histories,
        keep_inputs=keep_inputs,
        checked_share=checked_share,
        sample_error=sample_error,
        path=path,
        overwrite=overwrite,
    )
    _check_together(scene, integration, execution, outputs)
    structures = number_of_structures("simulate", scene, structures)
    warn_of_implausible(scene, step=step, longest_step=longest_step)
    with interruptible():
        return Run(scene, structures, integration, execution, outputs, seed).result()


def _check_together(scene: Scene, integration: Integration, execution: Execution, outputs: Outputs) -> None:
    """Raise a ValueError if settings contradict each other or the scene."""
    path, error = outputs.path, outputs.sample_error
    if execution.cluster is not None and path is not None and not outputs.is_store and not outputs.reduced:
        raise ValueError(f"path must be a Zarr store with cluster=, as 'run{STORE_SUFFIX}', got {path!r}")
    if not scene.recorders and outputs.histories is None:
        raise ValueError("the scene has no recorders, so that nothing would be kept: name some, or ask for histories")
    for name, value in (("checked_share", outputs.checked_share), ("sample_error", error)):
        if value is not None and integration.resample:
            raise ValueError(
                f"{name} cannot detect the error that resample adds, because both runs use the resampled motion: "
                f"remove {name} or resample"
            )
    if error is not None and len(scene.excitation.event_names) > 1:
        raise ValueError("sample_error is of one event, and the scene has an EventSequence: use checked_share instead")
    if outputs.is_store:
        check_zarr()
