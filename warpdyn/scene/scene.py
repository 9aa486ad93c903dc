"""Scenes: a structure, its excitation, the scatter of its parameters and what is recorded."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from warpdyn.core.checks import one_of, real_number
from warpdyn.core.output_variables import RECORDERS
from warpdyn.ground_motions.designs import Cloud, OneMotionPerStructure, Stripes
from warpdyn.ground_motions.event_sequences import EventSequence
from warpdyn.ground_motions.filtered_noise import FilteredNoise
from warpdyn.ground_motions.motions import ForceHistory, FreeVibration, GroundMotion, HarmonicForce
from warpdyn.scene.scatter import SAMPLING, Scatter, central, check_scatter, representative
from warpdyn.structures.shear_building import LinearSystem, ShearBuilding

Excitation = (
    Stripes
    | Cloud
    | OneMotionPerStructure
    | EventSequence
    | FilteredNoise
    | HarmonicForce
    | ForceHistory
    | FreeVibration
)


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything that decides what a run computes, except how it is integrated.

    Args:
        structure: A ShearBuilding or a LinearSystem.
        excitation: Stripes, Cloud or OneMotionPerStructure, or an EventSequence of them; FilteredNoise; HarmonicForce,
            ForceHistory or FreeVibration; or one GroundMotion.
        scatter: How structures differ: parameter name -> RandomFactor, RandomValue, GivenValues, or a number that
            replaces the nominal value.
        correlation: Correlation of pairs of scattered parameters, (name, name) -> -1 to 1, of the underlying normals.
        sampling: "monte_carlo", "latin_hypercube" or "sobol".
        recorders: Names of the recorders; None for all of them: of a ShearBuilding "drift", "time_of_peak",
            "acceleration", "base_shear", "residual" and "energy"; of a LinearSystem "displacement", "acceleration"
            and "energy".
        collapse_drift_ratio: Storey drift ratio beyond which a sample counts as collapsed; None for none.
        tail: Free vibration after the end of a motion, or of each event of an EventSequence [s]; None for long enough
            to read each structure's residual drift.
        title: Title of the dataset.

    Raises:
        ValueError, TypeError: If a part is unknown or the parts do not fit each other.
    """

    structure: ShearBuilding | LinearSystem
    excitation: Excitation | GroundMotion
    scatter: Scatter = field(default_factory=dict)
    correlation: Mapping[tuple[str, str], float] = field(default_factory=dict)
    sampling: str = "monte_carlo"
    recorders: tuple[str, ...] | None = None
    collapse_drift_ratio: float | None = None
    tail: float | None = None
    title: str = "warpdyn ensemble"

    def __post_init__(self) -> None:
        if not isinstance(self.structure, ShearBuilding | LinearSystem):
            raise TypeError(f"structure must be a ShearBuilding or a LinearSystem, got {type(self.structure).__name__}")
        if isinstance(self.excitation, GroundMotion):
            object.__setattr__(self, "excitation", Cloud((self.excitation,)))
        if not isinstance(self.excitation, Excitation):
            raise TypeError(
                "excitation must be Stripes, Cloud, OneMotionPerStructure, EventSequence, GroundMotion, FilteredNoise, "
                f"HarmonicForce, ForceHistory or FreeVibration, got {type(self.excitation).__name__}"
            )
        if isinstance(self.excitation, EventSequence) and not isinstance(self.structure, ShearBuilding):
            raise TypeError(
                "an EventSequence needs a ShearBuilding: a LinearSystem comes out of an earthquake as it went into it"
            )
        self._check_width()
        one_of("sampling", self.sampling, SAMPLING)
        known = RECORDERS[self.structure.family]
        recorders = tuple(known) if self.recorders is None else self.recorders
        if not isinstance(recorders, tuple | list):
            raise TypeError(f"recorders must be a tuple of recorders, such as ('drift',), got {recorders!r}")
        if not isinstance(self.title, str):
            raise TypeError(f"title must be text, got {self.title!r}")
        for name in recorders:
            one_of(f"recorder of a {type(self.structure).__name__}", name, known)
        object.__setattr__(self, "recorders", tuple(sorted(set(recorders))))
        limit = self.collapse_drift_ratio
        if limit is not None:
            real_number("collapse_drift_ratio", limit, above=0)
            if "drift" not in self.recorders:
                raise ValueError("collapse_drift_ratio needs the recorder 'drift' of a ShearBuilding")
        if self.tail is not None:
            real_number("tail [s]", self.tail, least=0)
        check_scatter(self.structure, self.scatter, self.correlation)
        object.__setattr__(self, "scatter", MappingProxyType(dict(self.scatter)))
        object.__setattr__(self, "correlation", MappingProxyType(dict(self.correlation)))

    def _check_width(self) -> None:
        """Check that nodal loads and initial states have one value for each degree of freedom, or one for all."""
        dofs = self.structure.dofs
        for kind, name in ((HarmonicForce, "amplitude"), (FreeVibration, "displacement"), (FreeVibration, "velocity")):
            if isinstance(self.excitation, kind):
                size = getattr(self.excitation, name).size
                if size != dofs and (size != 1 or kind is HarmonicForce):
                    raise ValueError(f"{kind.__name__}.{name} has {size} values for {dofs} degrees of freedom")
        displaced = isinstance(self.excitation, FreeVibration) and np.any(self.excitation.displacement)
        forgets = {*self.structure.storey_laws, *self.structure.devices} <= {"elastic", "viscous_damper"}
        if displaced and not forgets:
            raise ValueError(
                f"FreeVibration.displacement needs an elastic structure: the force of a {self.structure.law!r} "
                "storey at a displacement depends on how it came there; start from a velocity"
            )
        if isinstance(self.excitation, ForceHistory) and self.excitation.force.shape[1] != dofs:
            columns = self.excitation.force.shape[1]
            raise ValueError(f"ForceHistory.force has {columns} columns for {dofs} degrees of freedom")

    @property
    def central_parameters(self) -> dict[str, np.ndarray]:
        """The medians of the scattered parameters, of shape [storey] or []."""
        return central(self.structure, self.scatter)

    @property
    def representative_parameters(self) -> dict[str, np.ndarray]:
        """Values of the scattered parameters that are equal only where all values that can be drawn are equal."""
        return representative(self.structure, self.scatter)

    def to_json(self) -> str:
        """Return the scene as JSON, with the shape in place of long arrays; the dataset holds the drawn inputs."""
        return json.dumps(_plain(self), separators=(",", ":"))


def structure_to_json(structure: ShearBuilding | LinearSystem) -> str:
    """Return a structure as JSON, as it is in the JSON of a scene."""
    return json.dumps(_plain(structure), separators=(",", ":"))


def _plain(value: Any) -> Any:
    """Return a value in types that JSON knows, recursively."""
    if isinstance(value, GroundMotion):
        return {"name": value.name, "source": value.source, "step": value.step, "samples": value.acceleration.size}
    if isinstance(value, np.ndarray):
        if value.size > 1024:
            return f"array of shape {value.shape}"
        # JSON has no NaN, which marks storeys whose law does not take a parameter.
        return np.where(np.isnan(value), None, value).tolist() if value.dtype.kind == "f" else value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return {key if isinstance(key, str) else " ".join(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, ShearBuilding | LinearSystem):
        kept = {"law": value.law, "damping": value.damping}
        if value.family == "chain":
            storey_settings = {"damping_modes": value.damping_modes, "damped_storeys": value.damped_storeys}
            kept |= {name: list(storeys) for name, storeys in storey_settings.items() if storeys}
            if len(value.storey_laws) > 1:
                kept["storey_laws"] = list(value.storey_laws)
        else:
            kept["influence"] = value.influence.tolist()
        return {"type": type(value).__name__, **kept, **_plain(value.parameters)}
    if hasattr(value, "__dataclass_fields__"):
        fields = {name: _plain(getattr(value, name)) for name in value.__dataclass_fields__}
        return fields if isinstance(value, Scene) else {"type": type(value).__name__, **fields}
    return value
