"""Public class `Outputs`: settings that decide which results a run returns and to which file it writes them."""

from __future__ import annotations

import collections.abc
import os
from dataclasses import dataclass

from warpdyn.campaigns.reductions.reduction import checked_statistics
from warpdyn.campaigns.reductions.statistic import Statistic
from warpdyn.campaigns.running.histories import Histories
from warpdyn.foundations.core.checks import real_number, true_or_false
from warpdyn.foundations.files.unfinished import STORE_SUFFIX


@dataclass(frozen=True, kw_only=True)
class Outputs:
    """Settings that decide which results a run returns and to which file it writes them.

    Args:
        statistics: Statistics that the samples are reduced to after they are integrated: one object, or a list of
            objects, of DamageCounts, DemandMoments, DemandHistogram, LargestDemand or DamageLoss. The dataset then
            contains only these statistics, and neither inputs nor demands of single samples. None: keep the samples.
        histories: Samples whose whole response histories are returned; None: no histories.
        keep_inputs: Whether the dataset contains the drawn parameters of each sample.
        checked_share: Share of the samples [1] (at least 30 samples) that are run again at half the step and in
            float64 (multistep methods: by RK4), to estimate the relative error of every demand; None: no estimate.
        sample_error: Relative error [1] that no sample may exceed, such as 0.05; None: no estimate. Every sample is
            then run twice more: at half the step in float64, for `estimated_relative_error_of_sample`, and with its
            motion scaled by 1.001, for the flag `sensitive`. The run takes three to six times as long.
        path: NetCDF file (run.nc) or Zarr store (run.zarr) to write to; None: return the dataset in memory.
        overwrite: Whether to replace an existing result at `path` that has another scene, seed or other arguments.

    Raises:
        ValueError: If a number is out of its range, or `statistics` is combined with an argument that needs single
            samples.
        TypeError: If an argument is of another type.

    Example:
        >>> outputs = wd.Outputs(checked_share=0.1, keep_inputs=False)
        >>> run = wd.simulate(scene, structures=3, outputs=outputs)
        >>> "mass" in run, "estimated_relative_error" in run
        (False, True)
    """

    statistics: Statistic | collections.abc.Sequence[Statistic] | None = None
    histories: Histories | None = None
    keep_inputs: bool = True
    checked_share: float | None = None
    sample_error: float | None = None
    path: str | os.PathLike | None = None
    overwrite: bool = False

    def __post_init__(self) -> None:
        share, error = self.checked_share, self.sample_error
        asked = () if self.statistics is None else tuple(checked_statistics(self.statistics))
        object.__setattr__(self, "statistics", asked or None)
        for name in ("histories", "sample_error"):
            if asked and getattr(self, name) is not None:
                raise ValueError(
                    f"{name} needs single samples, but a run with `statistics` does not keep them: remove {name} or "
                    "statistics"
                )
        if share is not None and not 0 < real_number("checked_share", share) <= 1:
            raise ValueError(f"checked_share must be a share of the samples, above 0 and at most 1, got {share}")
        if error is not None and not 0 < real_number("sample_error", error) < 1:
            raise ValueError(f"sample_error must be a relative error, above 0 and below 1, got {error}")
        true_or_false("keep_inputs", self.keep_inputs)
        true_or_false("overwrite", self.overwrite)
        if self.histories is not None and not isinstance(self.histories, Histories):
            raise TypeError(f"histories must be Histories(samples, every), got {self.histories!r}")

    @property
    def reduced(self) -> tuple[Statistic, ...]:
        """The requested statistics as a tuple; empty if the run returns single samples."""
        return self.statistics or ()  # type: ignore[return-value]

    @property
    def is_store(self) -> bool:
        """Whether `path` names a Zarr store (ends with ".zarr")."""
        return isinstance(self.path, str | os.PathLike) and os.fspath(self.path).endswith(STORE_SUFFIX)

    @property
    def identity(self) -> tuple[object, ...]:
        """Settings on which the values of a run depend, as a tuple for the fingerprint of the run."""
        return self.checked_share, self.sample_error, self.histories, self.keep_inputs, *self.reduced
