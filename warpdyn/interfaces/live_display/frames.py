"""Frames of a live display: what the page shows at one moment, as a dictionary that JSON can describe."""

from __future__ import annotations

from collections import deque

import numpy as np
import xarray as xr

from warpdyn.campaigns.live.followed_sample import FollowedSample
from warpdyn.campaigns.live.live import Live
from warpdyn.campaigns.reductions.limits import DRIFT
from warpdyn.foundations.core.checks import one_of, whole_number
from warpdyn.foundations.core.output_variables import COLLAPSED, DIVERGED
from warpdyn.interfaces.live_display.series import MOST_TIMES, Series, envelope, numbers
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.shear_building import ShearBuilding

BAND = (0.05, 0.5, 0.95)  # quantiles of the peak drifts that are shown
MOST_STATES = 3000  # last states of the hysteresis loop that are shown: 30 s at 100 Hz
OF_FORCES = 1e-3  # kN per N
OF_DEFORMATIONS = 1e3  # mm per m


class Frames:
    """The frames of a live ensemble.

    Args:
        live: The live ensemble.
        sample: Index of the sample whose hysteresis loop is shown; None: no loop.
        storey: Number of the storey of the loop, counted from 1; in a LumpedStructure, number or name of a spring.

    Raises:
        ValueError: If the ensemble does not have this sample or storey, does not record drifts, or its answers contain
            neither the samples nor the quantiles that are shown.
    """

    def __init__(self, live: Live, sample: int | None, storey: int | str) -> None:
        self.live, self.sample = live, sample
        scene = live.scene
        self.structure = scene.structure
        if "drift" not in scene.recorders:
            raise ValueError(
                'the display shows storey drifts, which the scene does not record: add "drift" to its recorders'
            )
        if not live.keep_samples and not set(BAND) <= set(live.quantiles.tolist()):
            raise ValueError(
                f"the display shows the quantiles {BAND} of the peak drifts, which the answers of this Live do not "
                f"contain: give quantiles={BAND} to wd.Live, or keep_samples=True"
            )
        self._shares, self._loop = Series(), np.zeros((0, 2))
        self._has_collapsed = False  # the sample of the loop
        self._noted: deque[tuple[float, np.ndarray]] = deque(maxlen=MOST_TIMES)  # shares since the last frame
        self.followed: FollowedSample | None = None
        if sample is not None:
            whole_number("sample", sample, 0, live.structures - 1)
            self._place, self.place_name = self._checked_place(storey)
            [motion] = scene.excitation.motions
            self.followed = FollowedSample(live.paused.ensemble, sample, len(motion.values))

    def _checked_place(self, storey: int | str) -> tuple[int, str]:
        """Return the index of a storey or spring, and its name on the page."""
        structure = self.structure
        if isinstance(structure, ShearBuilding):
            return whole_number("storey", storey, 1, structure.dofs) - 1, f"storey {storey}"
        if not isinstance(structure, LumpedStructure):
            raise ValueError("this structure has no storeys or springs with hysteresis: give sample=None")
        names = structure.names_along("spring")
        if not isinstance(storey, str):
            storey = names[whole_number("storey (the number of a spring)", storey, 1, len(names)) - 1]
        one_of("storey (the name of a spring)", storey, names)
        return names.index(storey), f"spring {storey}"

    def note(self, answer: xr.Dataset) -> None:
        """Keep the shares of the damage states of an answer, which may not get a frame."""
        found = answer.variables  # faster than the coordinates and arrays of the dataset
        if "damage_probability" in found:
            self._noted.append((float(found["time"].values), found["damage_probability"].values))

    def of(self, answer: xr.Dataset | None) -> dict[str, object]:
        """Return the frame of an answer; None: no packet has arrived yet."""
        live = self.live
        [motion] = live.scene.excitation.motions
        frame: dict[str, object] = {
            "title": live.scene.title,
            "samples": live.structures,
            "expected": float(motion.step * (len(motion.values) - 1)),
            "time": 0.0,
        }
        if answer is None or "time" not in answer.coords:
            return frame
        time = float(answer["time"])
        record = live.record[: round(time / live.step) + 1]
        frame["time"] = time
        frame |= {name: numbers(answer.attrs[name]) for name in ("lag", "gap")}
        frame |= {name: int(answer.attrs[name]) for name in ("packets", "refused_packets")}
        width, low, high = envelope(record[:, 0])
        frame["motion"] = {"step": width * live.step, "low": numbers(low), "high": numbers(high)}
        frame["drift"] = self._drifts(answer)
        if live.limits is not None:
            while self._noted:
                self._shares.append(*self._noted.popleft())
            frame["shares"] = {
                "states": [str(state) for state in answer["damage_state"].values],
                "times": numbers(np.array(self._shares.times)),
                "values": numbers(np.array(self._shares.values).T),
            }
        if self.followed is not None:
            frame["loop"] = self._loop_after(record)
        return frame

    def _drifts(self, answer: xr.Dataset) -> dict[str, object]:
        """Return quantiles of the peak drift ratios over height, and the limits of the damage states."""
        drifts: dict[str, object] = {}
        known = self.live.quantiles.tolist()
        if set(BAND) <= set(known):
            places = [known.index(each) for each in BAND]
            found = answer[f"{DRIFT}_quantile"].transpose("quantile", "storey").values[places]
        else:
            ended = answer["status"].values < DIVERGED
            values = answer[DRIFT].transpose("sample", "storey").values
            values = values if ended.all() else values[ended]
            found = np.quantile(values, BAND, axis=0) if len(values) else np.full((len(BAND), values.shape[1]), np.nan)
        if self.live.keep_samples:
            drifts["failed"] = int(np.sum(answer["status"].values >= DIVERGED))
            drifts["collapsed"] = int(np.sum(answer["status"].values == COLLAPSED))
        else:
            drifts["failed"] = int(answer["failed_count"].sum())
            drifts["collapsed"] = int(answer["collapsed_count"])
        drifts["quantiles"] = numbers(found)
        drifts["floors"] = numbers(np.concatenate([[0.0], np.cumsum(self.structure.nominal_values["height"])]))
        limits = self.live.limits
        if limits is not None and DRIFT in limits.demands:
            row = limits.values[limits.demands.index(DRIFT)]
            drifts["limits"] = dict(zip(limits.states, numbers(row), strict=True))
        return drifts

    def _loop_after(self, record: np.ndarray) -> dict[str, object]:
        """Return the hysteresis loop up to the end of the record, whose last states are kept for the next frame."""
        assert self.followed is not None
        place, structure, labels = self._place, self.structure, ["drift [mm]", "storey force [kN]"]
        if isinstance(structure, LumpedStructure):
            deformation, force = self.followed.follow(record, "spring_deformation", "spring_force")
            turns = structure.kinds.rotating["spring"][place]
            labels = ["rotation [mrad]", "moment [kN m]"] if turns else ["deformation [mm]", "force [kN]"]
        else:
            displacement, force = self.followed.follow(record, "displacement", "storey_force")
            deformation = np.diff(displacement, axis=1, prepend=0.0)
        new = np.stack([OF_DEFORMATIONS * deformation[:, place], OF_FORCES * force[:, place]], axis=1)
        is_known = np.isfinite(new).all(axis=1)  # not after a collapse
        self._has_collapsed |= not is_known.all()
        self._loop = np.concatenate([self._loop, new[is_known]])[-MOST_STATES:]
        return {
            "title": f"sample {self.sample}, {self.place_name}",
            "x": numbers(self._loop[:, 0]),
            "y": numbers(self._loop[:, 1]),
            "labels": labels,
            "step": self.live.step,
            "has_collapsed": self._has_collapsed,
        }
