"""Scenes: a structure, its excitation, the scatter of its parameters and the recorders."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from warpdyn.engine.kernels.composing.user_recorders import USERS, recorder_name
from warpdyn.engine.kernels.output_table import RECORDERS
from warpdyn.foundations.core.checks import one_of, real_number
from warpdyn.foundations.core.description import html_table, to_json
from warpdyn.foundations.core.frozen_values import FrozenMapping
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.ground_motions.designs import excitation_of
from warpdyn.model.ground_motions.excitation import Excitation
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.scene.correlation import check_correlation
from warpdyn.model.scene.recording.floor_spectra import FloorSpectra
from warpdyn.model.scene.scatter import SAMPLING, GivenValues, Scatter, central, check_scatter, representative
from warpdyn.model.structures.lumped.matrices import INCIDENCE
from warpdyn.model.structures.lumped.places.storeys import needs_storeys
from warpdyn.model.structures.structure import Structure

if TYPE_CHECKING:
    from warpdyn.model.control.control import Control

SPECTRA = "floor_spectra"  # recorder that needs settings
MOST_OSCILLATORS = 4096  # of a structure: a CPU thread keeps their states on its stack


def _described(given: object) -> str:
    """Return the name of an argument's class for an error message; if it is a class, "the class ... itself"."""
    return f"the class {given.__name__} itself" if isinstance(given, type) else type(given).__name__


def _advice(given: object, kind: type) -> str:
    """Return advice for a wrong argument that contains, or is the class of, a Structure or Excitation; otherwise ""."""
    if isinstance(given, type) and issubclass(given, kind):
        return f"; give {given.__name__}(...)"
    if kind is Structure:
        return "; give its `portfolio`" if isinstance(getattr(given, "portfolio", None), Structure) else ""
    if isinstance(given, list | tuple) and given and all(isinstance(each, GroundMotion) for each in given):
        return "; give Cloud(motions) for unscaled motions, or Stripes(motions, levels, measure)"
    return ""


def _check_components(structure: Structure, excitation: Excitation) -> None:
    """Raise a ValueError if the base motion has another number of components than the structure's influence matrix."""
    count = excitation.base_components
    if count and count != structure.components:
        one = "a PairOfMotions" if count > 1 else "a single motion"
        raise ValueError(
            f"the structure has {structure.components} influence vectors, but the base motion has {count} components "
            f"({one}): a pair of motions needs a LumpedStructure with one influence vector for each component, and a "
            "single motion needs one influence vector"
        )


def _check_incidence(scatter: Scatter, excitation: Excitation) -> None:
    """Raise a ValueError if angles of incidence are scattered, but the base does not move."""
    if INCIDENCE in scatter and not excitation.base_components:
        raise ValueError(
            f"scatter[{INCIDENCE!r}] has no effect under a {type(excitation).__name__}, which does not move the base: "
            f"remove {INCIDENCE!r}, or give a PairOfMotions"
        )


@with_suggestions
@dataclass(frozen=True, eq=False, repr=False)
class Scene:
    """The model of a run: structure, excitation, scatter and recorders. The integration method is not part of it.

    Args:
        structure: A ShearBuilding, a LumpedStructure, a LinearSystem, or a Portfolio of building types with their
            scatter.
        excitation: Ground motions (Stripes, Cloud, OneMotionPerStructure, MotionsAtSites, one GroundMotion, or an
            EventSequence of these), FilteredNoise, or forces (HarmonicForce, ForceHistory,
            ForceStripes, FreeVibration).
        scatter: Differences between structures: parameter name -> RandomFactor, RandomValue or GivenValues.
        correlation: Correlation of pairs of scattered parameters [1]: (name, name) -> -1 to 1. It is the correlation
            of the standard normal variables from which the values are computed.
        sampling: "sobol" (scrambled; default), whose medians vary least from seed to seed, "latin_hypercube" or
            "monte_carlo". A portfolio always has "monte_carlo".
        recorders: Names of the recorders. None: all recorders, which for a ShearBuilding are "drift", "time_of_peak",
            "acceleration", "base_shear", "residual" and "energy"; for a LinearSystem "displacement", "acceleration" and
            "energy"; and for a LumpedStructure "spring", "displacement", "acceleration", "residual", "energy" and
            "output"; with `floor_spectra=` also "floor_spectra". For frames with hinges whose joints are a grid, and
            for such fish-bones, the default method is "leapfrog" without "residual", and "rk4" with it. All results
            then differ by the error of the methods (0.1 % for two storeys); give `method` if you compare such runs.
        collapse_drift_ratio: Storey drift ratio [1] at which a sample collapses. Integration of the sample ends at
            collapse: its demands are those up to collapse, its residual drift is missing, and `time_of_collapse` and
            `storey_of_collapse` are recorded. Storeys may also have capacities (`drift_capacity` and
            `drift_ratio_capacity` of a ShearBuilding). None: no collapse limit, except 0.5 if the building has a
            `gravity_load` and no drift capacities.
        tail: Duration of free vibration after the end of a motion, or of each event of an EventSequence [s]; None:
            long enough to determine the residual drift of each structure.
        record_from: Time from which peaks and their times are recorded [s], from the start of the run or of each event
            of an EventSequence; for example, to record a steady state without its transient. Residual drifts,
            energies, collapses and histories refer to the whole run. If a sample collapses before this time, its
            peaks are those up to collapse.
        floor_spectra: Periods and damping ratio of the recorder "floor_spectra" (a FloorSpectra); None: this recorder
            is not used.
        title: Title of the dataset.
        control: Control of the structure: actuators, sensors and controller (`wd.control.Control`). Forces, strokes and
            work of the actuators are then recorded, too. None: no control.

    Raises:
        ValueError, TypeError: If an argument is invalid, or the arguments do not fit each other.

    Example:
        >>> scene = wd.Scene(building, wd.Cloud(motions), scatter, recorders=("drift",))
        >>> run = wd.simulate(scene, structures=3)
        >>> int((run["status"] == 0).sum())  # samples with status ok
        24
    """

    structure: Structure
    excitation: Excitation
    scatter: Scatter = field(default_factory=dict)
    correlation: Mapping[tuple[str, str], float] = field(default_factory=dict)
    sampling: str = None  # type: ignore[assignment]  # a name once it is checked
    recorders: tuple[str, ...] = None  # type: ignore[assignment]  # a tuple once it is checked
    collapse_drift_ratio: float | None = None
    tail: float | None = None
    record_from: float = 0.0
    floor_spectra: FloorSpectra | None = None
    title: str = "warpdyn ensemble"
    control: Control | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.structure, Structure):
            raise TypeError(
                "structure must be a ShearBuilding, a LumpedStructure, a LinearSystem or a Portfolio, got "
                f"{_described(self.structure)}{_advice(self.structure, Structure)}"
            )
        excitation = excitation_of(self.excitation)
        if not isinstance(excitation, Excitation):
            raise TypeError(
                "excitation must be Stripes, Cloud, OneMotionPerStructure, MotionsAtSites, EventSequence, "
                "GroundMotion, FilteredNoise, HarmonicForce, ForceHistory or FreeVibration, "
                f"got {_described(self.excitation)}{_advice(self.excitation, Excitation)}"
            )
        object.__setattr__(self, "excitation", excitation)
        if self.structure.is_many and not excitation.is_design:
            kind = type(excitation).__name__
            raise TypeError(
                "the excitation of a portfolio must be Stripes, Cloud, OneMotionPerStructure or MotionsAtSites, "
                f"got {kind}"
            )
        excitation.check_fits(self.structure)
        _check_components(self.structure, excitation)
        if self.sampling is None:
            object.__setattr__(self, "sampling", "monte_carlo" if self.structure.is_many else "sobol")
        one_of("sampling", self.sampling, SAMPLING)
        if self.structure.is_many and self.sampling != "monte_carlo":
            raise ValueError(
                f"sampling of a portfolio must be 'monte_carlo', got {self.sampling!r}: "
                "its buildings are drawn one by one. Remove sampling="
            )
        known = RECORDERS[self.structure.family]
        lacking = self.structure.lacking
        every = known.keys() - USERS.keys() - set(lacking) - (set() if self.floor_spectra else {SPECTRA})
        recorders = tuple(every) if self.recorders is None else self.recorders
        if not isinstance(recorders, tuple | list):
            raise TypeError(f"recorders must be a tuple of recorders, such as ('drift',), got {recorders!r}")
        if not isinstance(self.title, str):
            raise TypeError(f"title must be text, got {self.title!r}")
        recorders = tuple(map(recorder_name, recorders))
        if self.control is not None:
            from warpdyn.model.control.fit import check_control  # imports SciPy's solvers of linear algebra

            check_control(self.control, self.structure, excitation)
        for name in recorders:
            one_of(f"recorder of a {type(self.structure).__name__}", name, known)
            if name in lacking:
                kind = type(self.structure).__name__
                needs = {
                    "drift": needs_storeys(self.structure),
                    "energy": f"is not possible: energies of a {kind} are not recorded. Remove it",
                }.get(name, f"needs {name}s= of the {kind}")
                raise ValueError(f"recorder {name!r} {needs}")
        object.__setattr__(self, "recorders", tuple(sorted(set(recorders))))
        self._check_floor_spectra()
        limit = self.collapse_drift_ratio
        if limit is not None:
            real_number("collapse_drift_ratio", limit, above=0)
            if "drift" not in known or "drift" in lacking:
                raise ValueError(
                    f"collapse_drift_ratio {needs_storeys(self.structure)}, or remove collapse_drift_ratio="
                )
        if self.tail is not None:
            real_number("tail [s]", self.tail, least=0)
            if not self.excitation.has_tail and self.tail > 0:
                kind = type(self.excitation).__name__
                warn_caller(f"the tail of {self.tail:g} s is ignored: a {kind} has its own duration. Remove tail=")
        record_from = real_number("record_from [s]", self.record_from, least=0)
        object.__setattr__(self, "record_from", record_from)
        if record_from > 0 and record_from >= self.shortest_run:
            raise ValueError(
                f"record_from is {record_from:g} s, but the shortest sample ends at {self.shortest_run:g} s, so that "
                "none of its peaks would be recorded. Give an earlier record_from, or a longer excitation"
            )
        check_scatter(self.structure, self.scatter)
        _check_incidence(self.scatter, excitation)
        check_correlation(self.structure, self.scatter, self.correlation)
        object.__setattr__(self, "scatter", FrozenMapping(dict(self.scatter)))
        object.__setattr__(self, "correlation", FrozenMapping(dict(self.correlation)))

    def _check_floor_spectra(self) -> None:
        """Raise an error if the recorder of floor spectra has no settings, or the settings have no recorder."""
        given = self.floor_spectra
        if given is not None and not isinstance(given, FloorSpectra):
            raise TypeError(f"floor_spectra must be FloorSpectra(periods, damping_ratio), got {_described(given)}")
        if (given is None) == (SPECTRA not in self.recorders):
            if given is not None and self.structure.is_many:
                raise ValueError(
                    "floor spectra of a Portfolio are not recorded: simulate a scene of the building of each "
                    "archetype, or remove 'floor_spectra' and floor_spectra="
                )
            count = 0 if given is None else len(given.periods) * self.structure.dofs
            if count > MOST_OSCILLATORS:
                raise ValueError(
                    f"FloorSpectra has {count:,} oscillators in each structure, but a kernel has at most "
                    f"{MOST_OSCILLATORS:,}: give fewer periods"
                )
            return
        if given is None:
            raise ValueError(
                "the recorder 'floor_spectra' needs the periods of its oscillators: give "
                "floor_spectra=wd.FloorSpectra(periods=[0.1, 0.2, 0.5])"
            )
        raise ValueError(
            "floor_spectra= is given, but its recorder is missing: add 'floor_spectra' to recorders=, or remove "
            "floor_spectra="
        )

    @property
    def central_parameters(self) -> dict[str, np.ndarray]:
        """Median of each scattered parameter, as name -> array of shape [storey] or []."""
        return central(self.structure, self.scatter)

    @property
    def representative_parameters(self) -> dict[str, np.ndarray]:
        """Two values of each random parameter and all values of GivenValues, shape [value, storey] or [value].

        Storeys that have equal values in this mapping have equal values in every sample.
        """
        return representative(self.structure, self.scatter)

    @property
    def sampling_of_structures(self) -> str:
        """Sampling method of the structures: the attribute `sampling`, or "given" if no parameter is random."""
        is_drawn = self.structure.is_many or any(not isinstance(s, GivenValues) for s in self.scatter.values())
        return self.sampling if is_drawn else "given"

    @property
    def collapse_limit(self) -> float | None:
        """Storey drift ratio at which a sample collapses [1], either given or the default; None: no limit."""
        if self.collapse_drift_ratio is not None or self.structure.is_many:
            return self.collapse_drift_ratio
        return self.structure.default_collapse_drift_ratio

    @property
    def shortest_run(self) -> float:
        """Duration of the shortest ground motion, or of the load, including `tail` if it is given [s]."""
        known: Any = self.excitation  # noise, and loads that are formulas, have a duration instead of motions
        lengths = [motion.step * (len(motion.values) - 1) for motion in known.motions] or [known.duration]
        return min(lengths) + (self.tail or 0.0 if known.has_tail else 0.0)

    @property
    def structures_given(self) -> int:
        """Number of structures for which the scene lists parameter values or motions; 0 if it lists none."""
        listed = [len(spread.values) for spread in self.scatter.values() if isinstance(spread, GivenValues)]
        return max([*listed, self.excitation.structures_given])

    def description(self) -> dict[str, object]:
        """Return the arguments of the scene as a dictionary, from which its JSON is made."""
        found = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return found if self.control is not None else {name: each for name, each in found.items() if name != "control"}

    def to_json(self) -> str:
        """Return the scene as JSON text. Of an array with more than 1,024 values, the JSON contains only the shape.

        Example:
            >>> scene.to_json()[:40]
            '{"structure":{"type":"ShearBuilding","la'
        """
        return to_json(self)

    @classmethod
    def from_json(cls, text: str, motions: GroundMotion | Sequence[GroundMotion] = ()) -> Self:
        """Return the scene that a dataset's attribute `scene` describes; a new run gives bit-identical results.

        Args:
            text: The JSON.
            motions: The ground motions of the scene, in any order; additional motions are ignored. The JSON contains
                only a digest of each motion's samples. The components of a PairOfMotions can be given instead of it.

        Raises:
            ValueError: If a motion is missing, the JSON contains only the shape of a long array, or an object has a
                class that a user wrote. The message names the motion, array or class.
            TypeError: If `text` is not text, or a motion is not a GroundMotion.

        Example:
            >>> same = wd.Scene.from_json(run.attrs["scene"], motions)
            >>> again = wd.simulate(same, structures=3, seed=run.attrs["seed"])
            >>> bool((again["peak_storey_drift_ratio"] == run["peak_storey_drift_ratio"]).all())
            True
        """
        # Imported here, because it imports every kind of structure, which takes 30 ms of a new process.
        from warpdyn.model.scene.rebuilding import arguments_of_scene

        return cls(**arguments_of_scene(text, motions))

    def __repr__(self) -> str:
        scattered = f", scatter of {', '.join(self.scatter)}" if self.scatter else ""
        return f"Scene({self.structure!r}, {self.excitation!r}{scattered})"

    def _repr_html_(self) -> str:
        rows: list[tuple[object, ...]] = [("structure", repr(self.structure)), ("excitation", repr(self.excitation))]
        rows += [(f"scatter of {name}", repr(spread)) for name, spread in self.scatter.items()]
        rows += [(f"correlation of {' and '.join(pair)}", value) for pair, value in self.correlation.items()]
        limit = "none" if self.collapse_limit is None else self.collapse_limit
        rows += [
            ("sampling", self.sampling),
            ("recorders", ", ".join(self.recorders)),
            ("collapse drift ratio", limit),
            ("tail", "until residual drifts can be read" if self.tail is None else f"{self.tail:g} s"),
            ("recorded from", f"{self.record_from:g} s"),
        ]
        return html_table(f"Scene: {self.title}", rows)


def with_recorders(scene: Scene, recorders: Iterable[str]) -> Scene:
    """Return a scene with other recorders, without the settings of recorders that it no longer has."""
    only = tuple(recorders)
    return replace(scene, recorders=only, floor_spectra=scene.floor_spectra if SPECTRA in only else None)
