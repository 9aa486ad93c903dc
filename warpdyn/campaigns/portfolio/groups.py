"""Groups of a portfolio's buildings that share a kernel and a default step; each group is run as one scene."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from warpdyn.campaigns.integration.dynamics import Dynamics
from warpdyn.campaigns.integration.model import central_vibration, dynamics_of, plan_of
from warpdyn.campaigns.integration.sampler import REMEDY_OF_COMBINATIONS, Sampler
from warpdyn.campaigns.integration.settings import Integration
from warpdyn.campaigns.integration.time_grid import default_step
from warpdyn.engine.methods.table import METHODS, Method, check_fits
from warpdyn.foundations.core.messages import amount_of, collected_warnings, warn_caller
from warpdyn.model.scene.portfolio import Portfolio, named
from warpdyn.model.scene.scatter import DrawnValues, GivenValues
from warpdyn.model.scene.scene import Scene
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.physics import physics_problem
from warpdyn.model.structures.shear_building import ShearBuilding
from warpdyn.model.structures.structure import Structure

# Default steps are 10 ms divided by a power of 2. They divide the steps of most records, so that rounding down costs
# little, and buildings with similar periods share a launch.
ROUND_STEP = 0.01  # [s]


@dataclass(frozen=True, eq=False)
class Group:
    """A group of a portfolio's buildings, which are integrated by one run.

    Args:
        scene: Scene of the group; it lists the values of every parameter for each building.
        buildings: Numbers of the buildings in the portfolio, increasing.
        longest_step: Upper bound of the buildings' steps [s]; None: the settings of the run decide.
        archetypes: Names of the archetypes of the buildings.
    """

    scene: Scene
    buildings: np.ndarray
    longest_step: float | None
    archetypes: tuple[str, ...]

    @contextmanager
    def named_in_messages(self) -> Iterator[None]:
        """Return a context in which messages of errors and warnings begin with a description of these buildings."""
        shown = ", ".join(repr(name) for name in self.archetypes[:3]) + (", ..." if len(self.archetypes) > 3 else "")
        many = "s" if len(self.archetypes) > 1 else ""
        structure: ShearBuilding | LumpedStructure = self.scene.structure  # type: ignore[assignment]  # of an Archetype
        count, storeys = amount_of(self.buildings.size, "building"), amount_of(structure.storeys, "storey")
        who = f"{count} of {storeys} (archetype{many} {shown})"
        caught: list[tuple[str, type[Warning]]] = []
        try:
            with collected_warnings() as caught:
                yield
        except ValueError as error:
            raise ValueError(f"{who}: {error}") from error
        except RuntimeError as error:
            raise RuntimeError(f"{who}: {error}") from error
        finally:
            for message, category in caught:
                warn_caller(f"{who}: {message}", category)


def scenes_of(scene: Scene) -> dict[str, Scene]:
    """Return the scene of each archetype of a portfolio, by the name of the archetype.

    Args:
        scene: The scene of a portfolio.

    Raises:
        ValueError: If an archetype is not compatible with the scene; the message names the archetype.
    """
    scenes = {}
    for name, archetype in portfolio_of(scene).archetypes.items():
        with named(name):
            if isinstance(archetype.building, LumpedStructure) and scene.recorders != ("drift",):
                raise ValueError(
                    "a portfolio with lumped structures records storey drifts only, because shear buildings have no "
                    "springs: give Scene(..., recorders=('drift',))"
                )
            scenes[name] = replace(
                scene, structure=archetype.building, scatter=archetype.scatter, correlation=archetype.correlation
            )
    return scenes


def portfolio_of(scene: Scene) -> Portfolio:
    """Return the portfolio of a scene whose structure is a portfolio."""
    assert isinstance(scene.structure, Portfolio)
    return scene.structure


def checked_archetypes(scene: Scene, method: str) -> dict[str, tuple[Scene, Dynamics]]:
    """Return the scene and the equation of motion of each archetype, by name; check that the method supports each.

    Raises:
        ValueError: If an archetype is not compatible with the scene or the method; the message names the archetype.
    """
    found = {}
    for name, own in scenes_of(scene).items():
        dynamics = dynamics_of(own)
        with named(name):
            check_fits(method, dynamics.forces, own.structure.damping)
        found[name] = own, dynamics
    return found


def groups_of(
    portfolio: Portfolio, archetypes: dict[str, tuple[Scene, Dynamics]], integration: Integration, seed: int
) -> list[Group]:
    """Return the buildings of a portfolio in groups, one group for each kernel and default step.

    The kernel, the step and the parameters of a building do not depend on the rest of the portfolio.

    Args:
        portfolio: The portfolio.
        archetypes: Scenes and equations of motion by archetype, from `checked_archetypes`.
        integration: Settings of the integration.
        seed: Seed of every random draw.

    Raises:
        ValueError: If a drawn value is out of the bounds of its parameter.
    """
    method, row = integration.nominal_method, METHODS[integration.nominal_method]
    members: dict[tuple, list[int]] = {}
    names, drawn = list(archetypes), []
    for place, (name, (own, dynamics)) in enumerate(archetypes.items()):
        drawn.append(parameters_of(portfolio, name, seed))  # before the step, so that errors name the drawn values
        longest = None if integration.is_stepped else _rounded_step(own, dynamics, row)
        # The kernel may depend on parameter values, such as a law's exponents or the kind of viscous dampers. The
        # number type and the device are the same for all archetypes.
        kernel = plan_of(own, dynamics, method, "float32", is_gpu=False)
        # Default steps, checks and reruns in float64 depend on these properties, which all buildings of a group share.
        treated = dynamics.counts_reversals, dynamics.is_sensitive
        members.setdefault((kernel, *_kind(own.structure, place), *treated, longest), []).append(place)
    groups = []
    # Low buildings first: their kernels are compiled fastest, and most buildings of a city are low.
    for (*_, longest), places in sorted(members.items(), key=lambda member: member[0][0].dofs):
        values = [drawn[place] for place in places]
        buildings = np.concatenate([portfolio.first[i] + np.arange(portfolio.counts[i]) for i in places])
        listed = {key: DrawnValues(np.concatenate([parameters[key] for parameters in values])) for key in values[0]}
        one = archetypes[names[places[0]]][0]
        excitation = one.excitation.of_structures(buildings, seed)
        whole = replace(one, scatter=listed, correlation={}, excitation=excitation)
        groups.append(Group(whole, buildings, longest, tuple(names[place] for place in places)))
    return groups


def _kind(building: Structure, place: int) -> tuple:
    """Return the properties (other than kernel and parameter values) that all buildings of a group must share.

    Args:
        building: The building of an archetype.
        place: Number of the archetype. Each archetype of a LumpedStructure is a group, because its matrices are not
            parameters.
    """
    if not isinstance(building, ShearBuilding):
        return (place,)
    damping = building.damping, building.damping_modes, building.damped_storeys
    own_storeys = tuple(building.own_storeys.tolist())
    return (
        building.storey_law.of_storeys,
        building.storey_law.devices,
        tuple(building.parameters),
        own_storeys,
        *damping,
    )


def parameters_of(portfolio: Portfolio, name: str, seed: int) -> dict[str, np.ndarray]:
    """Return every parameter of the buildings of one archetype, by name, shape [building, storey] or [building].

    Args:
        portfolio: The portfolio.
        name: Name of the archetype.
        seed: Seed of every random draw.

    Raises:
        ValueError: If a value is out of the bounds of its parameter, or values contradict each other.
    """
    archetype, place = portfolio.archetypes[name], list(portfolio.archetypes).index(name)
    building, count, first = archetype.building, int(portfolio.counts[place]), int(portfolio.first[place])
    listed = {key: spread for key, spread in archetype.scatter.items() if isinstance(spread, GivenValues)}
    others = {key: spread for key, spread in archetype.scatter.items() if key not in listed}
    with named(name):
        values = Sampler(building, listed, {}, "monte_carlo", count, seed).draw(np.arange(count), is_all=False)
        if others:
            sampler = Sampler(building, others, archetype.correlation, "monte_carlo", first + count, seed)
            values |= sampler.draw(np.arange(first, first + count), is_all=False)
        nominal = building.parameters.items()
        values = {k: values[k] if k in values else np.broadcast_to(v, (count, *v.shape)) for k, v in nominal}
        problem = building.problem(values) or physics_problem(values)
        if problem:
            raise ValueError(f"drawn: {problem}; {REMEDY_OF_COMBINATIONS}")
    return values


def _rounded_step(scene: Scene, dynamics: Dynamics, method: Method) -> float:
    """Return the default step of an archetype [s], rounded down to ROUND_STEP divided by a power of 2."""
    step = default_step(central_vibration(scene, dynamics, method), dynamics.share_of_default_step)
    return ROUND_STEP / 2.0 ** max(0, int(np.ceil(np.log2(ROUND_STEP / step) - 1e-9)))
