"""Buildings that twist: three degrees of freedom per floor, frames and walls at positions in plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws import Parameter
from warpdyn.engine.laws.law import Law
from warpdyn.foundations.core.checks import checked_text, finite_numbers, one_of, real_number, shortened, true_or_false
from warpdyn.foundations.core.frozen_values import FrozenMapping
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.structures.builders.storey_springs import axial_forces, storey_springs
from warpdyn.model.structures.lumped.biaxial_spring import BiaxialSpring
from warpdyn.model.structures.lumped.matrices import Values
from warpdyn.model.structures.lumped.places.storey_values import floor_masses, storey_values
from warpdyn.model.structures.lumped.spring import Spring
from warpdyn.model.structures.lumped.structure import FACTOR_OF_ZERO, MOST_DOFS, LumpedStructure
from warpdyn.model.structures.lumped.torsion import torsional_matrices

ECCENTRICITIES = ("eccentricity_x", "eccentricity_y")
BASE_MOTIONS = {"xy": (0, 1), "x": (0,), "y": (1,)}
ANGLES = {"x": 0.0, "y": np.pi / 2}


@with_suggestions
class PlanFrame:
    """A frame or wall of a TorsionalBuilding: a vertical plane with one spring per storey.

    Args:
        name: Name of the frame; its springs have the names "{name} 1", "{name} 2" and so on, from the ground up.
        position: A point x, y of the frame in plan [m], shape [2].
        direction: "x" or "y", or the angle from the x axis [rad].
        stiffness: Initial storey stiffness [N/m], one value or shape [storey].
        law: Storey law: its name, its class, or an object with its parameters. See `warpdyn.laws.LAWS`.
        **parameters: Parameters of a law that is given by name, such as `yield_force` [N], and `damping_coefficient`
            [N s/m] and `deformation_capacity` [m] of the springs: one value or one per storey.

    Raises:
        ValueError: If a value is not finite, or the direction is unknown.
        TypeError: If the name is not text.

    Example:
        >>> wd.PlanFrame("A", (0.0, 5.0), "x", [6e7, 5e7], law="bilinear", yield_force=[9e5, 7e5], hardening_ratio=0.05)
        PlanFrame('A', x = 0 m, y = 5 m, direction 'x')
    """

    def __init__(
        self,
        name: str,
        position: ArrayLike,
        direction: str | float,
        stiffness: ArrayLike,
        *,
        law: str | Law | type[Law] = "elastic",
        **parameters: ArrayLike,
    ) -> None:
        self.name = checked_text("PlanFrame: name", name)
        where = f"frame {self.name!r}"
        point = finite_numbers(f"{where}: position", position, "m")
        if point.shape != (2,):
            raise ValueError(f"{where}: position must be x, y in m, such as (0.0, 5.0), got {shortened(position)}")
        self.position = (float(point[0]), float(point[1]))
        self.direction = direction
        if isinstance(direction, str):
            one_of(f"{where}: direction", direction, ANGLES)
            self.angle = ANGLES[direction]
        else:
            self.angle = real_number(f"{where}: direction [rad]", direction)
        self.stiffness = stiffness
        self.law = law
        self.parameters = dict(parameters)

    def __repr__(self) -> str:
        x, y = self.position
        return f"PlanFrame({self.name!r}, x = {x:g} m, y = {y:g} m, direction {self.direction!r})"


@with_suggestions
class TorsionalBuilding(LumpedStructure):
    """A building with rigid floors that move in x and y and rotate about the vertical axis.

    Each floor has the degrees of freedom "ux1", "uy1" (displacements of the reference point, i.e. the origin of the
    coordinates in plan [m]) and "theta1" (rotation [rad]), with the number of the floor. The drift of a frame in a
    storey is the displacement of its point along its direction, less that of the floor below.

    Outputs are the storey drifts of the edges of the plan: "x1 at y=-6" is the drift in x of storey 1 at the edge (and
    both corners) y = -6 m. With `corner_drifts=True` the outputs include the resultant drifts of the corners, i.e. the
    square root of the sum of the squares (SRSS) of the drifts in x and y at each time: "1 at x=-10, y=-6" is that of
    storey 1.

    The parameters `eccentricity_x` and `eccentricity_y` [m] move the centres of mass of all floors; their value is 0,
    and `scatter` can make them random: `{"eccentricity_x": wd.RandomValue(wd.Uniform(-1.0, 1.0))}`.

    Args:
        floor_mass: Floor masses from the first floor up [kg], shape [floor].
        plan: Ends of the rectangular plan [m], shape [2, 2]: [[x from, x to], [y from, y to]].
        frames: The frames and walls, inside the plan.
        mass_centre: Centre of mass x, y [m], inside the plan, shape [2] or [floor, 2]; None: the centre of the plan.
        inertia: Moment of inertia about the vertical axis through the centre of mass [kg m2], one value or shape
            [floor]; None: that of a uniform rectangle, m (a^2 + b^2) / 12.
        base_motion: Components of the base motion: "xy" (the motions are of the class PairOfMotions), "x" or "y".
        storey_height: Storey heights [m], one value or shape [storey]; needed with `gravity_load`, and for storey drift
            ratios (recorder "drift", collapse_drift_ratio, portfolios). The drift of a storey is the largest one of its
            frames and walls, each along its direction.
        gravity_load: Vertical load of each floor [N], shape [floor], or "weight" for the weight of the floor masses;
            None: no P-Delta. The load of a floor has the distribution in plan of its mass without
            `eccentricity_x` and `eccentricity_y`.
        corner_drifts: Whether the outputs include the resultant drift of each corner in each storey.
        damping: Inherent damping, as for a LumpedStructure: "none", "rayleigh", "mass_proportional",
            "stiffness_proportional" or "modal".
        damping_ratio: Viscous damping ratio [1].
        damping_modes: The two modes of Rayleigh damping, counted from 1; None: 1 and 2, which are often of different
            directions of the same shape: give modes that enclose the important ones, such as (1, 5).
        damping_matrix: Viscous damping in addition to `damping` [N s/m], symmetric, shape [dof, dof].

    Raises:
        ValueError: If a frame or a centre of mass is outside the plan, a value is out of its range, a length is wrong,
            two frames have one name, or the building can move freely, has more than 64 degrees of freedom or buckles.
        TypeError: If `frames` is not a list of PlanFrames.

    Example:
        Two storeys, whose stiffer wall is at x = -9 m.

        >>> frames = [
        ...     wd.PlanFrame("front", (0.0, -5.0), "x", 5e7),
        ...     wd.PlanFrame("back", (0.0, 5.0), "x", 5e7),
        ...     wd.PlanFrame("wall", (-9.0, 0.0), "y", 9e7),
        ...     wd.PlanFrame("frame", (9.0, 0.0), "y", 3e7),
        ... ]
        >>> plan = [[-10.0, 10.0], [-6.0, 6.0]]  # m
        >>> twisting = wd.TorsionalBuilding([1.5e5, 1.2e5], plan, frames, damping="modal", damping_ratio=0.05)
        >>> list(twisting.outputs)[:4]
        ['x1 at y=-6', 'x1 at y=6', 'y1 at x=-10', 'y1 at x=10']
        >>> random = {"eccentricity_x": wd.RandomValue(wd.Uniform(-1.0, 1.0))}  # m
        >>> scene = wd.Scene(twisting, wd.PairOfMotions(motions[0], motions[1]), random, recorders=("output",))
        >>> wd.simulate(scene, structures=4, device="cpu")["peak_output"].sel(output="y1 at x=10").sizes["sample"]
        4
    """

    def __init__(
        self,
        floor_mass: ArrayLike,
        plan: ArrayLike,
        frames: Sequence[PlanFrame],
        *,
        mass_centre: ArrayLike | None = None,
        inertia: ArrayLike | None = None,
        base_motion: str = "xy",
        storey_height: ArrayLike | None = None,
        gravity_load: ArrayLike | str | None = None,
        corner_drifts: bool = False,
        damping: str = "none",
        damping_ratio: float | None = None,
        damping_modes: tuple[int, int] | None = None,
        damping_matrix: ArrayLike | None = None,
    ) -> None:
        masses = floor_masses(floor_mass)
        floors = masses.size
        if 3 * floors > MOST_DOFS:
            raise ValueError(
                f"floor_mass has {floors} floors with 3 degrees of freedom each, but a lumped structure has at most "
                f"{MOST_DOFS} degrees of freedom: combine storeys, so that there are at most {MOST_DOFS // 3} floors"
            )
        _check_frames(frames)
        one_of("base_motion", base_motion, BASE_MOTIONS)
        places = [(*frame.position, frame.angle) for frame in frames]
        try:
            matrices = torsional_matrices(masses, plan, places, mass_centre=mass_centre, inertia=inertia)
        except ValueError as error:
            raise ValueError(_with_names(str(error), frames)) from None
        names = matrices.names
        ends, centres = finite_numbers("plan", plan), _centres(matrices.mass)
        springs = []
        of_storeys: list[list[str]] = [[] for _ in range(floors)]
        for place, frame in enumerate(frames):
            where = f"frame {frame.name!r}"
            stiffness = storey_values(f"{where}: stiffness", frame.stiffness, floors, "N/m")
            rows = matrices.directions[:, place]
            directions = [_as_coefficients(row, names) for row in rows]
            of_frame = [f"{frame.name} {storey + 1}" for storey in range(floors)]
            of_storeys = [[*own, name] for own, name in zip(of_storeys, of_frame, strict=True)]
            springs += storey_springs(where, of_frame, directions, stiffness, frame.law, frame.parameters)
        outputs: dict[str, Any] = _edge_drifts(ends, floors)
        if true_or_false("corner_drifts", corner_drifts):
            outputs |= _corner_drifts(outputs, ends, floors)
        of_centre = matrices.mass.diagonal().copy()
        of_centre[2::3] -= masses * (centres**2).sum(axis=1)
        self._set_up(
            dict(zip(names, of_centre, strict=True)),
            springs,
            plan=ends,
            mass_centres=centres,
            influence=[_as_coefficients(matrices.influence[:, each], names) for each in BASE_MOTIONS[base_motion]],
            geometric_stiffness=_geometric_stiffness(matrices.mass, masses, storey_height, gravity_load),
            damping_matrix=damping_matrix,
            outputs=outputs,
            output_units=dict.fromkeys(outputs, "m"),
            damping=damping,
            damping_ratio=damping_ratio,
            damping_modes=damping_modes,
            storey_height=storey_height,
            storey_springs=None if storey_height is None else of_storeys,
        )

    def scatter_problem(self, name: str, *, is_common_factor: bool) -> str | None:
        """Return why the masses of one floor would contradict each other, or a factor has no effect; else None."""
        if name in ECCENTRICITIES and is_common_factor:
            return FACTOR_OF_ZERO.format(name, "-1.0, 1.0")
        if name != "mass" or is_common_factor:
            return super().scatter_problem(name, is_common_factor=is_common_factor)
        return (
            "the masses of a floor in x and y are equal, and its moment of inertia follows from them: give "
            "RandomFactor(..., per='building'), which multiplies all of them"
        )

    @classmethod
    def of_parts(
        cls, mass: Mapping[str, float], springs: Sequence[Spring | BiaxialSpring], **arguments: Any
    ) -> TorsionalBuilding:
        """Return a building from its springs, its plan and the centres of mass of its floors, as in its JSON."""
        building = cls.__new__(cls)
        building._set_up(mass, springs, **arguments)
        return building

    def _set_up(
        self,
        mass: Mapping[str, float],
        springs: Sequence[Spring | BiaxialSpring],
        *,
        plan: np.ndarray,
        mass_centres: np.ndarray,
        **arguments: Any,
    ) -> None:
        """Set all attributes; masses are those about the centres of mass."""
        self.plan, self.mass_centres = plan, mass_centres
        super().__init__(mass, springs, **arguments)
        shifts = {
            name: Parameter("m", f"{name[-1]} of the centres of mass, from their nominal position")
            for name in ECCENTRICITIES
        }
        self.parameter_table = FrozenMapping({**self.parameter_table, **shifts})
        self.parameters = FrozenMapping({**self.parameters, **dict.fromkeys(shifts, np.array(0.0))})

    def mass_matrices(self, values: Values) -> np.ndarray:
        """Return the mass matrices [kg], shape [structure, dof, dof]."""
        found = values["mass"][:, :, None] * np.eye(len(self.dof_names))
        x, y = (
            self.mass_centres[:, axis] + np.asarray(values.get(name, 0.0)).reshape(-1, 1)
            for axis, name in enumerate(ECCENTRICITIES)
        )
        of_x, of_y = values["mass"][:, 0::3], values["mass"][:, 1::3]
        first = np.arange(0, len(self.dof_names), 3)
        found[:, first, first + 2] = found[:, first + 2, first] = -of_x * y
        found[:, first + 1, first + 2] = found[:, first + 2, first + 1] = of_y * x
        found[:, first + 2, first + 2] += of_x * y**2 + of_y * x**2
        return found

    def problem(self, values: Values) -> str | None:
        """Return a sentence on values that are wrong, such as a centre of mass outside the plan, or None."""
        for axis, name in enumerate(ECCENTRICITIES):
            shift = np.atleast_1d(values.get(name, 0.0))
            least, most = self.plan[axis] - [self.mass_centres[:, axis].min(), self.mass_centres[:, axis].max()]
            outside = (shift < least) | (shift > most)
            if outside.any():
                return (
                    f"{name} {shift[outside.argmax()]:g} m moves a centre of mass outside the plan: give values from "
                    f"{least:g} to {most:g} m, such as wd.RandomValue(wd.Uniform({least:g}, {most:g}))"
                )
        return super().problem({name: each for name, each in values.items() if name not in ECCENTRICITIES})

    def chosen(self) -> dict[str, Any]:
        """Return names, springs, matrices, outputs, damping, plan and centres of mass, for the structure's JSON."""
        return {**super().chosen(), "plan": self.plan.tolist(), "mass_centres": self.mass_centres.tolist()}

    def is_by_storey(self, name: str) -> bool:
        """Return whether a parameter has one value per spring or degree of freedom."""
        return name not in ECCENTRICITIES and super().is_by_storey(name)

    def __repr__(self) -> str:
        return f"TorsionalBuilding({self.dofs // 3} floors, {len(self.springs)} springs, damping={self.damping!r})"


def _check_frames(frames: object) -> None:
    if not isinstance(frames, list | tuple) or not all(isinstance(each, PlanFrame) for each in frames):
        raise TypeError(f"frames must be a list of wd.PlanFrame(name, position, direction, stiffness), got {frames!r}")
    if not frames:
        raise ValueError("frames is empty: give at least three frames, which resist motion in x, in y and rotation")
    names = [frame.name for frame in frames]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"two frames have the name {name!r}: rename one of them")


def _with_names(message: str, frames: Sequence[PlanFrame]) -> str:
    """Return a message on matrices with the names of frames instead of their numbers."""
    for place, frame in enumerate(frames):
        message = message.replace(f"frames[{place}]", f"frame {frame.name!r}")
    return message


def _as_coefficients(row: np.ndarray, names: Sequence[str]) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, row, strict=True) if value}


def _centres(mass: np.ndarray) -> np.ndarray:
    """Return the centres of mass [m], shape [floor, 2], from the mass matrix."""
    first = np.arange(0, len(mass), 3)
    of_floor = mass[first, first]
    return np.stack([mass[first + 1, first + 2], 0.0 - mass[first, first + 2]], axis=1) / of_floor[:, None]


def _edge_drifts(plan: np.ndarray, floors: int) -> dict[str, Mapping[str, float]]:
    """Return the storey drifts of the edges of the plan, {name: {degree of freedom: coefficient}}."""
    found: dict[str, Mapping[str, float]] = {}
    for floor in range(1, floors + 1):
        for axis, across, sign in (("x", "y", -1.0), ("y", "x", 1.0)):
            for place in plan["xy".index(across)]:
                row = {f"u{axis}{floor}": 1.0, f"theta{floor}": sign * place}
                if floor > 1:
                    row |= {f"u{axis}{floor - 1}": -1.0, f"theta{floor - 1}": -sign * place}
                found[f"{axis}{floor} at {across}={place:g}"] = row
    return found


def _corner_drifts(of_edges: Mapping[str, Mapping[str, float]], plan: np.ndarray, floors: int) -> dict[str, list]:
    """Return the resultant storey drifts of the corners, {name: [coefficients in x, coefficients in y]}."""
    return {
        f"{storey} at x={x:g}, y={y:g}": [of_edges[f"x{storey} at y={y:g}"], of_edges[f"y{storey} at x={x:g}"]]
        for storey in range(1, floors + 1)
        for x in plan[0]
        for y in plan[1]
    }


def _geometric_stiffness(
    mass: np.ndarray, floor_mass: np.ndarray, storey_height: ArrayLike | None, gravity_load: ArrayLike | str | None
) -> np.ndarray | None:
    """Return the geometric stiffness of the storeys; loads are distributed in plan as the masses of their floors.

    A vertical load P at (x, y) on columns of height h takes P / h away from the stiffness of the displacements of its
    point, ux - y theta and uy + x theta: a matrix of the form of the mass matrix.
    """
    forces = axial_forces(gravity_load, floor_mass)
    if forces is None:
        return None
    if storey_height is None:
        raise ValueError("storey_height is missing: gravity_load needs it; give storey_height= in m, such as 3.5")
    floors = floor_mass.size
    heights = storey_values("storey_height", storey_height, floors, "m")
    loads = forces - np.append(forces[1:], 0.0)
    found = np.zeros_like(mass)
    for floor in range(floors):
        place = slice(3 * floor, 3 * floor + 3)
        of_load = loads[floor] / floor_mass[floor] * mass[place, place]
        for storey in range(floor + 1):
            row = np.zeros((3, len(mass)))
            row[:, 3 * storey : 3 * storey + 3] = np.eye(3)
            if storey:
                row[:, 3 * storey - 3 : 3 * storey] = -np.eye(3)
            found += row.T @ of_load @ row / heights[storey]
    return found
