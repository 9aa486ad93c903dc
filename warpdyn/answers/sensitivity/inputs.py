"""The independent random inputs of a scene, and the structures of given values of these inputs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from warpdyn.foundations.core.checks import check_kind
from warpdyn.model.ground_motions.designs import Cloud, Stripes
from warpdyn.model.scene.correlation import correlation_factor
from warpdyn.model.scene.normal_variables.structures import values_of_normals
from warpdyn.model.scene.scatter import GivenValues, RandomScatter
from warpdyn.model.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Inputs:
    """The independent random inputs of a scene: one per parameter, or one per storey if its draws are independent.

    Args:
        scene: The scene.
        names: Name of each input, such as "mass" or "stiffness (storey 2)", shape [input].
        rows: Random variables of each input, shape [input][variable].
        factor: Factor of the correlation matrix of the random variables, shape [variable, variable].
    """

    scene: Scene
    names: list[str]
    rows: list[np.ndarray]
    factor: np.ndarray

    @property
    def variables(self) -> int:
        """Number of random variables of a structure."""
        return len(self.factor)

    def scene_of(self, normals: np.ndarray) -> Scene:
        """Return the scene with given structures: those of correlated normal values, shape [variable, structure]."""
        values = values_of_normals(self.scene.structure, self.scene.scatter, normals)
        given = {name: GivenValues(each) for name, each in values.items()}
        return replace(self.scene, scatter=given, correlation={})


def inputs_of(function: str, scene: Scene) -> Inputs:
    """Return the random inputs of a scene.

    Args:
        function: Name of the public function, for messages.
        scene: The scene.

    Raises:
        TypeError: If `scene` is not a Scene of one structure under a Cloud, Stripes or one motion.
        ValueError: If no parameter is random, values are given, parameters are correlated, or motions differ between
            structures.
    """
    check_kind(function, "a Scene", scene, Scene, argument="scene")
    design = scene.excitation
    if scene.structure.is_many or not isinstance(design, Cloud | Stripes):
        raise TypeError(
            f"{function}() needs a scene of one structure under a Cloud, Stripes or one GroundMotion, got a "
            f"{type(scene.structure).__name__} under {type(design).__name__}"
        )
    if isinstance(design, Stripes) and design.structures_per_motion not in (None, "crossed"):
        raise ValueError(
            f"{function}() runs every structure under every motion: remove structures_per_motion= of the Stripes"
        )
    if not scene.scatter:
        raise ValueError(f"{function}: the scene has no random parameter: give Scene(..., scatter=...)")
    for name, spread in scene.scatter.items():
        if not isinstance(spread, RandomScatter):
            raise ValueError(
                f"{function}: scatter[{name!r}] lists given values, which have no distribution: give a RandomFactor or "
                "RandomValue"
            )
    if pairs := [pair for pair, value in scene.correlation.items() if value]:
        raise ValueError(
            f"{function}: {pairs[0][0]} and {pairs[0][1]} are correlated, so that their effects cannot be separated: "
            "remove this correlation=, or use correlation_ratios(), which accepts correlated parameters"
        )
    structure = scene.structure
    names, rows, start = [], [], 0
    for name, spread in scene.scatter.items():
        assert isinstance(spread, RandomScatter)
        count = spread.variables(structure.length_of(name))
        varied = spread.varied(name, structure)
        has = ~np.isnan(np.atleast_1d(structure.nominal_values[name]))
        if spread.per == "building" or spread.storey_correlation:
            names.append(name)
            rows.append(np.arange(start, start + count))
        else:
            labels = structure.names_along(structure.dim_of(name))
            for place in np.flatnonzero(has if varied is None else has & varied):
                which = f"{spread.per} {place + 1}" if labels is None else labels[place]
                names.append(f"{name} ({which})")
                rows.append(np.array([start + place]))
        start += count
    _, factor = correlation_factor(structure, scene.scatter, {})
    return Inputs(scene, names, rows, factor)
