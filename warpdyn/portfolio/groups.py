"""A portfolio as a few scenes: buildings of one kernel and of like steps go together."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from warpdyn.core.checks import one_of
from warpdyn.ground_motions.designs import Cloud, OneMotionPerStructure, Stripes
from warpdyn.integration import packing
from warpdyn.integration.damping import law_to_integrate
from warpdyn.integration.time_grid import default_step
from warpdyn.integration.vibration import vibration_of
from warpdyn.methods.table import METHODS, check_fits
from warpdyn.portfolio.portfolio import Portfolio, named
from warpdyn.scene.scatter import GivenValues
from warpdyn.scene.scene import Scene

# Default steps are 10 ms divided by a power of 2: those of most records divide by them, so that rounding down costs
# little, and buildings of like periods share a launch.
ROUND_STEP = 0.01  # s


@dataclass(frozen=True, eq=False)
class Group:
    """Buildings that are integrated by one run.

    Args:
        scene: Their scene, every parameter listed.
        buildings: Their numbers in the portfolio, increasing.
        longest_step: Step [s] that theirs are not longer than; None to leave it to the run.
        archetypes: Names of their archetypes.
    """

    scene: Scene
    buildings: np.ndarray
    longest_step: float | None
    archetypes: tuple[str, ...]

    @contextmanager
    def named_in_messages(self) -> Iterator[None]:
        """Say in errors and warnings which buildings they speak of."""
        shown = ", ".join(repr(name) for name in self.archetypes[:3]) + (", ..." if len(self.archetypes) > 3 else "")
        many = "s" if len(self.archetypes) > 1 else ""
        who = f"{self.buildings.size} buildings of {self.scene.structure.storeys} storeys (archetype{many} {shown})"
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                yield
            except ValueError as error:
                raise ValueError(f"{who}: {error}") from error
        for warning in caught:
            warnings.warn(f"{who}: {warning.message}", warning.category, stacklevel=4)


def scenes_of(portfolio: Portfolio, common: Scene) -> dict[str, Scene]:
    """Return the scene of each archetype by itself.

    Args:
        portfolio: The buildings.
        common: A scene of any structure with what all archetypes have in common.

    Raises:
        ValueError: If an archetype does not fit; the message names it.
    """
    scenes = {}
    for name, archetype in portfolio.archetypes.items():
        own = {"structure": archetype.building, "scatter": archetype.scatter, "correlation": archetype.correlation}
        with named(name):
            scenes[name] = replace(common, **own)
    return scenes


def check_method(scenes: dict[str, Scene], method: str) -> None:
    """Raise a ValueError that names the archetype if a method is unknown or does not fit it."""
    one_of("method", method, METHODS)
    for name, scene in scenes.items():
        with named(name):
            check_fits(method, law_to_integrate(scene), scene.structure.damping)


def groups_of(
    portfolio: Portfolio, scenes: dict[str, Scene], method: str, seed: int, *, is_stepped: bool
) -> list[Group]:
    """Return the buildings in as few groups as there are kernels and default steps.

    A building's kernel, its step and its parameters do not depend on what else is in the portfolio.

    Args:
        portfolio: The buildings.
        scenes: The scene of each archetype by itself.
        method: Integration method, which fits them all.
        seed: Seed of every random draw.
        is_stepped: Whether the caller sees to the step.

    Raises:
        ValueError: If a drawn value is out of bounds.
    """
    members: dict[tuple, list[int]] = {}
    names, drawn = list(scenes), []
    for place, (name, scene) in enumerate(scenes.items()):
        building = scene.structure
        drawn.append(portfolio.parameters(name, seed))  # before the step: what is wrong is said of what is drawn
        longest = None if is_stepped else _rounded_step(scene, method)
        # The kernel, which values may decide on, too (a law's exponents, the kind of viscous dampers), and what it is
        # fed by; the type of numbers and the device are common to all.
        kernel = packing.plan_of(scene, method, "float32", is_gpu=False)
        kernel = kernel, building.storey_laws, building.devices, tuple(building.parameters)
        kernel = *kernel, building.damping, building.damping_modes, building.damped_storeys
        members.setdefault((*kernel, longest), []).append(place)
    groups = []
    for (*_, longest), places in members.items():
        values = [drawn[place] for place in places]
        buildings = np.concatenate([portfolio.first[i] + np.arange(portfolio.counts[i]) for i in places])
        listed = {key: GivenValues(np.concatenate([parameters[key] for parameters in values])) for key in values[0]}
        one = scenes[names[places[0]]]
        scene = replace(one, scatter=listed, correlation={}, excitation=_design_of(one.excitation, buildings))
        groups.append(Group(scene, buildings, longest, tuple(names[place] for place in places)))
    return groups


def _design_of(
    design: Stripes | Cloud | OneMotionPerStructure, buildings: np.ndarray
) -> Stripes | Cloud | OneMotionPerStructure:
    """Return the design of motions of some buildings."""
    if not isinstance(design, OneMotionPerStructure):
        return design
    return OneMotionPerStructure(design.motions, design.motion[buildings], design.scale[buildings], design.measure)


def _rounded_step(scene: Scene, method: str) -> float:
    """Return the step that an archetype would take by itself, rounded down."""
    central = {name: values[None] for name, values in scene.central_parameters.items()}
    step = default_step(vibration_of(scene, central, METHODS[method]))
    return ROUND_STEP / 2.0 ** max(0, int(np.ceil(np.log2(ROUND_STEP / step) - 1e-9)))
