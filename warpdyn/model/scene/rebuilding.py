"""Build a scene from its JSON, as in the attribute `scene` of a run; all objects must have classes of warpdyn."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from inspect import Parameter, signature
from typing import Any

import numpy as np

from warpdyn.engine.laws.lookup import check_written
from warpdyn.foundations.core.checks import shortened
from warpdyn.foundations.core.description import NAMED_BY_SHAPE
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.model.ground_motions import designs, event_sequences, filtered_noise
from warpdyn.model.ground_motions.forces import ForceHistory, FreeVibration, HarmonicForce
from warpdyn.model.ground_motions.measures import filtered_velocity, one_component, pairs
from warpdyn.model.ground_motions.motions import GroundMotion, checked_motions
from warpdyn.model.ground_motions.motions_at_sites import MotionsAtSites
from warpdyn.model.ground_motions.pairs_of_motions import PairOfMotions
from warpdyn.model.ground_motions.wind.force_stripes import ForceStripes
from warpdyn.model.scene import scatter
from warpdyn.model.scene.distributions import closed_form, numerical
from warpdyn.model.scene.portfolio import Archetype, Portfolio
from warpdyn.model.scene.recording.floor_spectra import FloorSpectra
from warpdyn.model.structures.builders.torsional_building import TorsionalBuilding
from warpdyn.model.structures.frames.frame import Frame
from warpdyn.model.structures.frames.hinged_fishbone import HingedFishbone
from warpdyn.model.structures.frames.hinges.hinged_frame import HingedFrame
from warpdyn.model.structures.frames.reduced_frame import ReducedFrame
from warpdyn.model.structures.lumped.biaxial_spring import BiaxialSpring
from warpdyn.model.structures.lumped.spring import Gauge, Spring
from warpdyn.model.structures.lumped.structure import MATRICES, LumpedStructure
from warpdyn.model.structures.shear_building import LinearSystem, ShearBuilding

OWN: dict[str, Any] = {  # name -> class of warpdyn that the JSON may contain
    each.__name__: each
    for each in (
        *(designs.Stripes, designs.Cloud, designs.OneMotionPerStructure, event_sequences.EventSequence),
        *(filtered_noise.FilteredNoise, filtered_noise.WhiteNoise, filtered_noise.KanaiTajimi),
        *(filtered_noise.CloughPenzien, filtered_noise.JenningsEnvelope),
        *(HarmonicForce, ForceHistory, ForceStripes, FreeVibration, MotionsAtSites),
        *(one_component.PeakGroundAcceleration, one_component.PeakGroundVelocity),
        *(one_component.PeakGroundDisplacement, one_component.AriasIntensity),
        *(one_component.CumulativeAbsoluteVelocity, one_component.SignificantDuration),
        *(one_component.SpectralAcceleration, one_component.AverageSpectralAcceleration),
        *(pairs.GeometricMean, pairs.LargerComponent, pairs.RotatedSpectralAcceleration),
        filtered_velocity.FilteredIncrementalVelocity,
        *(scatter.RandomFactor, scatter.RandomValue, scatter.GivenValues, scatter.GivenFactors),
        *(closed_form.Normal, closed_form.Lognormal, closed_form.Uniform),
        FloorSpectra,
        *(numerical.ScipyDistribution, numerical.Truncated, numerical.Empirical),
    )
}
SCENE_KEYS = (
    *("structure", "excitation", "scatter", "correlation", "sampling", "recorders", "collapse_drift_ratio"),
    *("tail", "record_from", "floor_spectra", "title", "control"),
)
ARCHETYPE_KEYS = ("structure", "count", "scatter", "correlation")
LUMPED_CHOICES = (
    *("damping", "damping_ratio", "outputs", "rotations", "groups", "output_units", "is_machine"),
    *("storey_height", "storey_springs"),
)
WITH_HINGES = {each.__name__: each for each in (HingedFishbone, HingedFrame)}
BUILDING_KEYS = ("law", "damping", "mass", "stiffness", "height")


def arguments_of_scene(text: str, motions: GroundMotion | Sequence[GroundMotion]) -> dict[str, Any]:
    """Return the arguments of the Scene that a JSON text describes; see `Scene.from_json` for arguments and errors."""
    if not isinstance(text, str):
        raise TypeError(
            f"from_json() takes the text of a dataset's attribute 'scene', got {type(text).__name__}: give "
            "run.attrs['scene']"
        )
    try:
        told = json.loads(text)
    except json.JSONDecodeError as error:
        raise ValueError(f"from_json(): the text is not JSON ({error}); give a dataset's attribute 'scene'") from None
    if not isinstance(told, dict) or not {"structure", "excitation"} <= told.keys():
        raise ValueError("from_json(): the JSON is not a scene; give a dataset's attribute 'scene'")
    _check_keys(told, "the scene", SCENE_KEYS, ("structure", "excitation"))
    is_empty = isinstance(motions, list | tuple) and not motions
    found = Rebuilding(() if is_empty else checked_motions(motions, or_pairs=True))
    return {
        **told,
        "structure": found.structure(told["structure"], "structure"),
        "excitation": found.value(told["excitation"], "excitation"),
        "scatter": found.value(told.get("scatter", {}), "scatter"),
        "correlation": _pairs(told.get("correlation", {})),
        "floor_spectra": found.value(told.get("floor_spectra"), "floor_spectra"),
        **({"control": found.control(told["control"])} if "control" in told else {}),
    }


def _check_keys(told: object, where: str, allowed: Collection[str], needed: Collection[str]) -> None:
    """Raise a ValueError if a value of the JSON is not an object, lacks a key, or has an unknown key (named)."""
    if not isinstance(told, Mapping):
        keys = f" with {', '.join(needed)}" if needed else ""
        raise ValueError(
            f"from_json(): {where} must be a JSON object{keys}, got {shortened(told)}: give the attribute 'scene' of a "
            "run without changes"
        )
    for key in needed:
        if key not in told:
            raise ValueError(
                f"from_json(): {where} has no {key!r}; it has {', '.join(map(repr, told))}: give the attribute 'scene' "
                "of a run without changes"
            )
    for key in told if allowed else ():
        if key not in allowed:
            hint = did_you_mean(key, list(allowed))
            raise ValueError(f"from_json(): {where} has unknown {key!r}{hint}; allowed are {', '.join(allowed)}")


def _made(kind: Any, inner: dict[str, Any], where: str) -> Any:
    """Return an object of the class `kind`, made with the arguments `inner` that were read from the JSON."""
    taken = signature(kind).parameters
    needed = [name for name, each in taken.items() if each.default is Parameter.empty]
    _check_keys(inner, where, list(taken), needed)
    return kind(**inner)


def _pairs(correlation: Mapping[str, float]) -> dict[tuple[str, ...], float]:
    _check_keys(correlation, "correlation", (), ())
    return {tuple(names.split(" ")): value for names, value in correlation.items()}


def _foreign(where: str, kind: str) -> ValueError:
    """Return the error for a JSON object whose class does not belong to warpdyn."""
    return ValueError(
        f"from_json(): {where} is of the class {kind!r}, which warpdyn does not have: build the scene with Scene(...)"
    )


class Rebuilding:
    """Builds objects from JSON. The JSON only describes ground motions; the given motions are used instead."""

    def __init__(self, motions: Sequence[GroundMotion]) -> None:
        self.by_digest = {motion.description()["digest"]: motion for motion in motions}

    def value(self, told: Any, where: str) -> Any:
        """Return the value or object that the JSON value `told` describes; `where` is its position, for errors."""
        if isinstance(told, str) and told.startswith(NAMED_BY_SHAPE):
            raise ValueError(
                f"from_json(): the values of {where} are not in the JSON, which contains only the shape of long arrays "
                f"({told.removeprefix(NAMED_BY_SHAPE)}): build the scene with Scene(...)"
            )
        if isinstance(told, list):
            return [self.value(each, f"{where}[{place}]") for place, each in enumerate(told)]
        if not isinstance(told, dict):
            return np.nan if told is None and ".values" in where else told
        if {"name", "step", "samples"} <= told.keys():
            return self.motion(told)
        inner = {name: self.value(each, f"{where}.{name}") for name, each in told.items() if name != "type"}
        if "type" not in told:
            return inner
        if told["type"] not in OWN:
            raise _foreign(where, told["type"])
        return _made(OWN[told["type"]], inner, where)

    def motion(self, told: dict[str, Any]) -> GroundMotion | PairOfMotions:
        """Return the ground motion among the given ones whose digest equals the digest in the description.

        A pair can be given as a pair, or as the single motions that are its components.
        """
        if told.get("digest") not in self.by_digest and isinstance(told.get("components"), list):
            components: Any = dict(zip(("x", "y", "vertical"), map(self.motion, told["components"]), strict=False))
            return PairOfMotions(**components, name=told["name"])
        if told.get("digest") not in self.by_digest:
            for each in self.by_digest.values():
                if isinstance(each, GroundMotion) and each.step == told["step"]:
                    longer = each.lengthened(told["samples"])  # as by PairOfMotions.from_records
                    if longer.description()["digest"] == told["digest"]:
                        return longer
            given = f"none of the {len(self.by_digest)} given motions has them; " if self.by_digest else ""
            raise ValueError(
                f"from_json(): the JSON does not contain the samples of motion {told['name']!r} ({told['samples']} at "
                f"{told['step']:g} s, from {told['source'] or 'an array'}): {given}give motions= that contain a motion "
                "with these samples"
            )
        return self.by_digest[told["digest"]]

    def control(self, told: dict[str, Any]) -> Any:
        """Return the control that a JSON object describes; a controller must be one of warpdyn."""
        from warpdyn.model import control  # imports SciPy's solvers of linear algebra

        own = {name: getattr(control, name) for name in control.__all__}

        def made(each: Any, where: str) -> Any:
            if not isinstance(each, dict) or "type" not in each:
                return [made(one, where) for one in each] if isinstance(each, list) else each
            if each["type"] not in own:
                raise _foreign(where, each["type"])
            inner = {name: made(value, f"{where}.{name}") for name, value in each.items() if name != "type"}
            return _made(own[each["type"]], inner, where)

        return made(told, "control")

    def structure(self, told: dict[str, Any], where: str) -> ShearBuilding | LumpedStructure | LinearSystem | Portfolio:
        """Return the structure that the JSON object `told` describes; `where` is its position, for errors."""
        _check_keys(told, where, (), ("type",))
        rest = dict(told)
        kind = rest.pop("type")
        if kind == "Portfolio":
            _check_keys(rest, where, (), ("archetypes",))
            _check_keys(rest["archetypes"], f"{where}.archetypes", (), ())
            return Portfolio({name: self.archetype(each, name) for name, each in rest["archetypes"].items()})
        if kind == "LinearSystem":
            rest.pop("law", None)
            return _made(LinearSystem, rest, where)
        if kind in ("LumpedStructure", "TorsionalBuilding"):
            return self.lumped(rest, where, is_torsional=kind == "TorsionalBuilding")
        if kind == "ReducedFrame":
            return self.reduced_frame(rest, where)
        if kind in WITH_HINGES:
            return self.with_hinges(WITH_HINGES[kind], rest, where)
        if kind != "ShearBuilding":
            raise _foreign(where, kind)
        _check_keys(rest, where, (), BUILDING_KEYS)
        check_written(rest.pop("written_laws", {}), f"from_json(): {where}")
        law, own_laws = rest.pop("law"), rest.pop("storey_laws", None)
        devices, added = tuple(rest.pop("devices", ())), rest.pop("added_storeys", ())
        chosen: dict[str, Any] = {
            name: tuple(rest.pop(name)) for name in ("damping_modes", "damped_storeys") if name in rest
        }
        law = own_laws or law.removesuffix("".join(f"+{device}" for device in devices))
        chosen |= {"damping": rest.pop("damping"), "devices": devices, "law": law}
        # The JSON has null instead of NaN in storeys whose law does not have the parameter.
        chosen |= {name: self._numbers(value, f"{where}.{name}") for name, value in rest.items()}
        building = ShearBuilding(**chosen)
        building.own_storeys[[storey - 1 for storey in added]] = False
        return building

    def lumped(self, told: dict[str, Any], where: str, *, is_torsional: bool) -> LumpedStructure:
        """Return the lumped structure that a JSON object without its type describes."""
        _check_keys(told, where, (), ("degrees_of_freedom", "mass", "springs", "influence", "damping"))
        check_written(told.get("written_laws", {}), f"from_json(): {where}")
        springs = []
        for each in told["springs"]:
            kind = BiaxialSpring if "direction_x" in each else Gauge if "is_gauge" in each else Spring
            values = {name: self.value(value, f"{where}.springs.{name}") for name, value in each.items()}
            values.pop("is_gauge", None)
            springs.append(kind(**values))
        names = told["degrees_of_freedom"]
        mass = self._numbers(told["mass"], f"{where}.mass").tolist()
        chosen: dict[str, Any] = {name: told[name] for name in LUMPED_CHOICES if name in told}
        chosen |= {"damping_modes": tuple(told["damping_modes"])} if "damping_modes" in told else {}
        for name in (*MATRICES, "load_mass"):
            if name in told:
                chosen[name] = self._numbers(self.value(told[name], f"{where}.{name}"), f"{where}.{name}")
        influence = [dict(zip(names, row, strict=True)) for row in told["influence"]]
        masses = dict(zip(names, mass, strict=True))
        if not is_torsional:
            return LumpedStructure(masses, springs, influence=influence, **chosen)
        _check_keys(told, where, (), ("plan", "mass_centres"))
        chosen |= {name: self._numbers(told[name], f"{where}.{name}") for name in ("plan", "mass_centres")}
        return TorsionalBuilding.of_parts(masses, springs, influence=influence, **chosen)

    def reduced_frame(self, told: dict[str, Any], where: str) -> ReducedFrame:
        """Return the reduced frame that a JSON object without its type describes."""
        _check_keys(told, where, (), ("frame", "dofs", "reduction", "damping"))
        given = dict(told)
        frame = _made(Frame, given.pop("frame"), f"{where}.frame")
        if "damping_modes" in given:
            given["damping_modes"] = tuple(given["damping_modes"])
        _check_keys(given, where, list(signature(Frame.lumped).parameters), ())
        return frame.lumped(**given)

    def with_hinges(self, kind: type[HingedFishbone | HingedFrame], told: dict[str, Any], where: str) -> Any:
        """Return the frame with hinges that a JSON object without its type describes."""
        _check_keys(told, where, (), ("frame", "hinges", "damping"))
        given = dict(told)
        frame = _made(Frame, given.pop("frame"), f"{where}.frame")
        if "damping_modes" in given:
            given["damping_modes"] = tuple(given["damping_modes"])
        hinges = {}
        for row in given.pop("hinges"):
            law = {name: self.value(value, f"{where}.hinges.{name}") for name, value in row.items()}
            hinges[law.pop("member"), law.pop("end")] = law
        _check_keys(given, where, list(signature(kind).parameters), ())
        return kind(frame, hinges, **given)

    def _numbers(self, told: object, where: str) -> np.ndarray:
        """Return the values of a building's parameter as an array; `where` is its position in the JSON, for errors."""
        try:
            return np.array(told, dtype=float)
        except (TypeError, ValueError):
            raise ValueError(
                f"from_json(): {where} must be numbers, got {told!r}: give the attribute 'scene' of a run without "
                "changes"
            ) from None

    def archetype(self, told: dict[str, Any], name: str) -> Archetype:
        """Return the archetype of a portfolio that the JSON object `told` describes; `name` is the archetype's name."""
        where = f"archetype {name!r}"
        _check_keys(told, where, ARCHETYPE_KEYS, ARCHETYPE_KEYS)
        building = self.structure(told["structure"], where)
        if not isinstance(building, ShearBuilding | LumpedStructure):
            raise ValueError(
                f"from_json(): {where} must be a ShearBuilding or a LumpedStructure, got {building!r}: give the "
                "attribute 'scene' of a run without changes"
            )
        correlation: Any = _pairs(told["correlation"])
        return Archetype(building, told["count"], self.value(told["scatter"], f"{where}.scatter"), correlation)
