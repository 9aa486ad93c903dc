"""Lumped structures: named degrees of freedom, connected by springs; checked when they are built."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.engine.laws import Parameter
from warpdyn.engine.laws.building_law import BuildingLaw
from warpdyn.foundations.core.checks import real_number, true_or_false
from warpdyn.foundations.core.frozen_values import FrozenMapping
from warpdyn.foundations.core.near_misses import did_you_mean, with_suggestions
from warpdyn.model.structures.lumped.biaxial_spring import BiaxialSpring
from warpdyn.model.structures.lumped.damping import checked_damping
from warpdyn.model.structures.lumped.matrices import INCIDENCE, OF_DOFS, OF_STRUCTURE, LumpedMatrices, of_springs_only
from warpdyn.model.structures.lumped.names import (
    as_given,
    check_dissipates,
    checked_coefficients,
    checked_influence,
    checked_matrix,
    checked_outputs,
)
from warpdyn.model.structures.lumped.places.free_motions import mass_problem, stiffness_problem
from warpdyn.model.structures.lumped.places.kinds import kinds_of
from warpdyn.model.structures.lumped.places.spring_values import (
    MOST_SPRINGS,
    checked_springs,
    parameters_of_springs,
    spring_values,
)
from warpdyn.model.structures.lumped.places.storeys import Storeys, check_different_storeys, checked_storeys
from warpdyn.model.structures.lumped.spring import Spring
from warpdyn.model.structures.modal import modal_properties
from warpdyn.model.structures.structure import Structure, count_along

MOST_DOFS = 64
PAIR = 2  # components of a biaxial spring
FACTOR_OF_ZERO = "the nominal value of {} is 0, which a factor does not change: give wd.RandomValue(wd.Uniform({}))"
MATRICES = {  # with their units
    "mass_matrix": "kg",
    "stiffness_matrix": "N/m",
    "damping_matrix": "N s/m",
    "geometric_stiffness": "N/m",
}


@with_suggestions
class LumpedStructure(LumpedMatrices, Structure):
    """A structure with at most 64 named degrees of freedom (DOFs), connected by at most 128 springs of any storey law.

    M q'' + C q' + spring forces + (K - K_geometric) q = -M_load I a(t), with the influence matrix I and the base
    accelerations a(t). Displacements q are relative to the base.

    A structure with two or more influence vectors has the parameter `incidence_angle` [rad], which `scatter` can
    make random: `{"incidence_angle": wd.RandomValue(wd.Uniform(0.0, 2 * np.pi))}`. It turns the structure anticlockwise
    below the first two components of the motion, as `PairOfMotions.turned` does. Its nominal value is 0.

    Args:
        mass: Mass of each degree of freedom, {name: mass}: [kg] for a translation, [kg m2] for a rotation.
        springs: The springs. A biaxial spring counts as two.
        influence: Displacement of each degree of freedom under a unit displacement of the base [1], {name: value}; for
            several components of base motion a list of such dictionaries. Missing degrees of freedom have 0. None: 1
            for each degree of freedom (only without rotations and if all coefficients of springs are 1 or -1).
        mass_matrix: Matrix that is added to the masses [kg], symmetric, shape [dof, dof]: an inerter, or the coupling
            between degrees of freedom that are not at the centre of mass. A common random factor on `mass` multiplies
            it, except for the part that is not in `load_mass`.
        load_mass: Mass matrix [kg] of the load, shape [dof, dof], or its diagonal, shape [dof]; None: the mass matrix.
            An inerter belongs to the mass matrix, but not to the load.
        stiffness_matrix: Elastic stiffness in addition to the springs [N/m], symmetric, shape [dof, dof].
        damping_matrix: Viscous damping in addition to `damping` [N s/m], symmetric, shape [dof, dof].
        geometric_stiffness: Stiffness that gravity takes away [N/m], symmetric, shape [dof, dof].
        outputs: Outputs as linear combinations of the displacements [m], or of displacements times a stiffness [N],
            {name: {degree of freedom: coefficient}}. A list of such dictionaries, {name: [{...}, {...}]}, is a
            resultant: the square root of the sum of the squares (SRSS) of these combinations at each time, such as the
            displacement in plan from those in x and y.
        damping: Inherent damping:
            "none";
            "rayleigh" (`damping_ratio` in the two modes `damping_modes`; in proportion to mass and initial stiffness
            without the geometric stiffness);
            "mass_proportional" or "stiffness_proportional" (`damping_ratio` in the first mode);
            "modal" (`damping_ratio` in every mode).
        damping_ratio: Viscous damping ratio [1].
        damping_modes: The two modes of Rayleigh damping, counted from 1; None: 1 and 2.
        rotations: Names of the degrees of freedom that are rotations [rad]; None: those whose name contains a word such
            as "theta", "rotation", "rocking" or "pitch". They decide the units in datasets.
        groups: Names of degrees of freedom and springs by group, {group: [name, ...]}, to which scatter can be
            restricted. The groups "equipment", "absorber", "soil" and "contact" do not count in the largest
            demand of the building. Places in no group are in the group "building".
        output_units: Units of the outputs, {name: unit}, such as "m"; `fragility` compares outputs of one unit only.
        is_machine: Whether the structure is a vehicle or a machine. It has no warnings about values that are unusual
            for buildings and earthquakes, and no parameter `incidence_angle`.
        storey_height: Storey heights from the ground up [m], one value or shape [storey]; needs `storey_springs`.
        storey_springs: Springs of each storey, from the ground up: a name or a list of names per storey; no biaxial
            springs. The drift of a storey is the largest deformation of its springs (recorder "drift");
            Scene(collapse_drift_ratio=...) and portfolios need it. None: no storeys.

    Raises:
        ValueError: If a name is unknown or given twice, a degree of freedom has no mass, a matrix has a wrong shape, is
            not symmetric, or (mass, damping) has a negative eigenvalue, or a part of the structure can move freely. The
            message names the degree of freedom or the spring.
        TypeError: If an argument is of another type.

    Example:
        A deck with one frame along y and two along x; it also rotates about its centre.

        >>> deck = wd.LumpedStructure(
        ...     {"x": 27e3, "y": 27e3, "theta": 27e4},  # kg, kg m2
        ...     [
        ...         wd.Spring("A", {"y": 1.0, "theta": 0.5}, stiffness=1.1e6),  # N/m
        ...         wd.Spring("B", {"x": 1.0, "theta": -3.0}, stiffness=5.8e5),
        ...         wd.Spring("C", {"x": 1.0, "theta": 3.0}, stiffness=5.8e5),
        ...     ],
        ...     influence={"y": 1.0},
        ...     damping="modal",
        ...     damping_ratio=0.05,
        ... )
        >>> deck
        LumpedStructure(3 degrees of freedom, 3 springs, law='elastic', damping='modal')
        >>> scene = wd.Scene(deck, wd.Cloud(motions), recorders=("spring",))
        >>> wd.simulate(scene, device="cpu")["peak_spring_deformation"].sel(spring="A").dims
        ('sample',)
    """

    family = "lumped"
    demand = "spring"
    devices = ()
    can_have_zero_outputs = False
    storey_springs: Storeys = ()  # places of the springs of each storey

    most_springs = MOST_SPRINGS

    def __init__(
        self,
        mass: Mapping[str, float],
        springs: Sequence[Spring | BiaxialSpring],
        *,
        influence: Mapping[str, float] | Sequence[Mapping[str, float]] | None = None,
        mass_matrix: ArrayLike | None = None,
        load_mass: ArrayLike | None = None,
        stiffness_matrix: ArrayLike | None = None,
        damping_matrix: ArrayLike | None = None,
        geometric_stiffness: ArrayLike | None = None,
        outputs: Mapping[str, Mapping[str, float] | Sequence[Mapping[str, float]]] | None = None,
        damping: str = "none",
        damping_ratio: float | None = None,
        damping_modes: tuple[int, int] | None = None,
        rotations: Sequence[str] | None = None,
        groups: Mapping[str, Sequence[str]] | None = None,
        output_units: Mapping[str, str] | None = None,
        is_machine: bool = False,
        storey_height: ArrayLike | None = None,
        storey_springs: Sequence[str | Sequence[str]] | None = None,
    ) -> None:
        if true_or_false("is_machine", is_machine):  # otherwise the class attribute
            self.is_machine = True
        masses = checked_coefficients("mass", mass)
        self.dof_names = tuple(masses)
        if not 1 <= len(masses) <= MOST_DOFS:
            raise ValueError(f"a lumped structure has 1 to {MOST_DOFS} degrees of freedom, got {len(masses)}")
        self.springs = checked_springs(springs, self.dof_names, self.most_springs)
        self.given_springs = tuple(springs)
        self.pairs = sum(isinstance(each, BiaxialSpring) for each in springs)
        directions = [spring.direction for spring in self.springs]
        self.influence = checked_influence(influence, self.dof_names, directions)
        self.outputs = checked_outputs(outputs, self.dof_names, can_be_zero=self.can_have_zero_outputs)
        self.kinds = kinds_of(self.dof_names, self.springs, self.outputs, rotations, groups, output_units)
        if influence is None and any(self.kinds.rotating["dof"]):
            turning = self.dof_names[self.kinds.rotating["dof"].index(True)]
            raise ValueError(
                f"influence is missing: {turning!r} is a rotation, which the base motion does not move. Give "
                "influence=, such as {'x': 1.0}, or rotations=[] if it is a translation"
            )
        given = dict(zip(MATRICES, (mass_matrix, stiffness_matrix, damping_matrix, geometric_stiffness), strict=True))
        self.matrices: Mapping[str, np.ndarray] = FrozenMapping(
            {
                name: checked_matrix(name, matrix, self.dof_names, MATRICES[name])
                for name, matrix in given.items()
                if matrix is not None
            }
        )
        if "damping_matrix" in self.matrices:
            check_dissipates(self.matrices["damping_matrix"], self.dof_names)
        self.load_mass = None
        if load_mass is not None:
            diagonal = np.asarray(load_mass)
            matrix = np.diag(diagonal) if diagonal.ndim == 1 else load_mass
            self.load_mass = checked_matrix("load_mass", matrix, self.dof_names, "kg")
        self.storey_law = BuildingLaw([spring.law for spring in self.springs])
        self.storey_laws = tuple(spring.law.name for spring in self.springs)
        self.law = self.storey_law.name
        self.damping, self.damping_modes = checked_damping(damping, damping_ratio, damping_modes, len(masses))
        arrays = {"mass": np.array(list(masses.values())), **spring_values(self.springs)}
        if damping_ratio is not None:
            arrays["damping_ratio"] = np.array(real_number("damping_ratio", damping_ratio))
        if self.components > 1 and not self.is_machine:
            arrays[INCIDENCE] = np.array(0.0)
        if storey_height is not None or storey_springs is not None:
            names, rotating = self.names_along("spring"), self.kinds.rotating["spring"]
            arrays["height"], self.storey_springs = checked_storeys(
                storey_height, storey_springs, names, rotating, self.pairs
            )
            check_different_storeys(self.storey_springs, self.directions != 0, self.dof_names)
        self.parameter_table: Mapping[str, Parameter] = FrozenMapping(parameters_of_springs(self.storey_law, arrays))
        for name in OF_STRUCTURE:
            problem = name in arrays and self.parameter_table[name].first_violation(name, arrays[name], ())
            if problem:
                raise ValueError(problem)
        self.parameters: Mapping[str, np.ndarray] = FrozenMapping(arrays)
        if problem := self.problem(self.parameters):
            raise ValueError(problem)

    def problem(self, values: Mapping[str, np.ndarray]) -> str | None:
        """Return a sentence on a wrong mass, a free motion or wrong parameters of springs; None if all are right."""
        problem = mass_problem(self, values) or stiffness_problem(self, values)
        return problem or self._pair_problem(values) or self.storey_law.problem(of_springs_only(values))

    def scatter_problem(self, name: str, *, is_common_factor: bool) -> str | None:
        """Return why heights are not random, or why a factor cannot change the angle of incidence; otherwise None."""
        if name == "height":
            return "the storey heights of a lumped structure cannot be random: remove height"
        return FACTOR_OF_ZERO.format(name, "0, 2 * np.pi") if is_common_factor and name == INCIDENCE else None

    def _pair_problem(self, values: Mapping[str, np.ndarray]) -> str | None:
        """Return a sentence on a parameter with different values in the components of a biaxial spring, or None."""
        for name, each in values.items():
            if self.pairs and self.is_by_storey(name) and self.dim_of(name) == "spring":
                first = len(self.springs) - PAIR * self.pairs
                pairs = each[..., first:].reshape(*each.shape[:-1], self.pairs, PAIR)
                bad = (pairs[..., 0] != pairs[..., 1]) & ~np.isnan(pairs).all(axis=-1)
                if bad.any():
                    spring = self.springs[first + PAIR * np.argwhere(bad)[0, -1]].name.removesuffix(" x")
                    return f"biaxial spring {spring!r}: {name} differs between its components: give both the same value"
        return None

    def tied(self, name: str, values: np.ndarray) -> np.ndarray:
        """Return drawn values, shape [spring, structure], with equal values in the components of biaxial springs."""
        if self.pairs and self.is_by_storey(name) and self.dim_of(name) == "spring":
            first = len(self.springs) - PAIR * self.pairs
            values[first + 1 :: PAIR] = values[first::PAIR]
        return values

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom."""
        return len(self.dof_names)

    @property
    def components(self) -> int:
        """Number of components of the base motion."""
        return int(self.influence.shape[1])

    @property
    def rotating_dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom that are rotations [rad]."""
        return tuple(name for name, turns in zip(self.dof_names, self.kinds.rotating["dof"], strict=True) if turns)

    @property
    def lacking(self) -> tuple[str, ...]:
        """Recorders that the structure cannot have: "output" without outputs, "drift" without storeys."""
        return (() if self.outputs else ("output",)) + (() if self.storey_springs else ("drift",))

    @property
    def storeys(self) -> int:
        """Number of storeys; 0 if the structure has no storeys."""
        return len(self.storey_springs)

    @property
    def nominal_values(self) -> Mapping[str, np.ndarray]:
        """Values of the parameters."""
        return self.parameters

    def is_by_storey(self, name: str) -> bool:
        """Return whether a parameter has one value per spring or degree of freedom."""
        return name not in OF_STRUCTURE

    def dim_of(self, name: str) -> str:
        """Return the dimension of a parameter's values: "dof", "storey" or "spring"."""
        return "dof" if name in OF_DOFS else "storey" if name == "height" else "spring"

    def length_along(self, dim: str) -> int:
        """Return the number of degrees of freedom ("dof"), springs, outputs or storeys."""
        lengths = {"spring": len(self.springs), "output": len(self.outputs), "storey": self.storeys}
        return lengths.get(dim, self.dofs)

    def names_along(self, dim: str) -> tuple[str, ...]:
        """Return the names of the degrees of freedom ("dof"), springs or storeys (numbers, from the ground up)."""
        if dim == "storey":
            return tuple(str(storey + 1) for storey in range(self.storeys))
        return self.dof_names if dim == "dof" else tuple(spring.name for spring in self.springs)

    def varied(self, name: str, only: tuple[str, ...] | tuple[int, ...] | None) -> np.ndarray | None:
        """Return which values of a parameter a random scatter draws, shape [place]; None: all; see Structure."""
        if not self.is_by_storey(name):
            return None
        dim = self.dim_of(name)
        found = self.kinds.of_building(dim)
        if not np.isfinite(self.parameters[name][found]).any():
            found = ~found  # a parameter of springs in added groups only, such as the clearance of contacts
        if only is not None:
            found = self.kinds.named(dim, self.names_along(dim), [str(each) for each in only])[0]
        return None if found.all() else found

    def only_problem(self, name: str, only: tuple[str, ...] | tuple[int, ...]) -> str | None:
        """Return why scatter of a parameter cannot be restricted to these names; None if it can."""
        if not self.is_by_storey(name):
            return f"{name} has one value for the structure: remove only="
        if not isinstance(only[0], str):
            return f"only= contains the number {only[0]}, but springs and degrees of freedom have names: give names"
        dim = self.dim_of(name)
        known = [*self.names_along(dim), *dict.fromkeys(self.kinds.groups[dim])]
        for each in self.kinds.named(dim, self.names_along(dim), [str(each) for each in only])[1]:
            what = "degree of freedom" if dim == "dof" else "spring"
            return f"only= names {each!r}, but no {what} and no group has this name{did_you_mean(each, known)}"
        return None

    def input_name(self, name: str) -> str:
        """Return the parameter's name."""
        return name

    def chosen(self) -> dict[str, Any]:
        """Return names, springs, matrices, influence, outputs and damping, for the structure's JSON."""
        found: dict[str, Any] = {
            "degrees_of_freedom": list(self.dof_names),
            "springs": [spring.description() for spring in self.given_springs],
            "influence": self.influence.T.tolist(),
            "damping": self.damping,
        }
        found |= {"damping_modes": list(self.damping_modes)} if self.damping_modes else {}
        found |= {"outputs": as_given(self.outputs)} if self.outputs else {}
        found |= {name: matrix.tolist() for name, matrix in self.matrices.items()}
        found |= {} if self.load_mass is None else {"load_mass": self.load_mass.tolist()}
        found |= {**self.kinds.given} | ({"is_machine": True} if self.is_machine else {})
        if self.storey_springs:
            names = self.names_along("spring")
            found |= {"storey_height": self.parameters["height"].tolist()}
            found |= {"storey_springs": [[names[place] for place in own] for own in self.storey_springs]}
        return found | ({"written_laws": texts} if (texts := self.storey_law.written) else {})

    def told(self) -> list[tuple[object, ...]]:
        """Return the rows of the structure's table in notebooks: first periods and parameters."""
        return [("first periods", "", self.modal()["period"].values[:3], "s"), *super().told()]

    def numbered(self, recorders: tuple[str, ...]) -> dict[str, tuple]:
        """Return the coordinates `dof`, `spring` and, if there are outputs, `output`: their names."""
        found = {"dof": ("dof", np.array(self.dof_names), {"long_name": "degree of freedom"})}
        names = np.array([spring.name for spring in self.springs])
        found["spring"] = ("spring", names, {"long_name": "spring"})
        if self.outputs and "output" in recorders:
            found["output"] = ("output", np.array(list(self.outputs)), {"long_name": "output"})
        if "drift" in recorders:
            found["storey"] = count_along("storey", self.storeys, "storey, from the ground up")
        return found | self.kinds.coordinates(found)

    def units_along(self, dims: tuple[str, ...], units: str) -> str:
        """Return the units of a variable with these dimensions, whose translations have the units `units`."""
        return self.kinds.units(dims[0], units) if dims else units

    def modal(self) -> xr.Dataset:
        """Return periods, shapes, participation factors and effective masses of the undamped structure.

        Springs have their initial stiffness; the geometric stiffness is subtracted. Participation factors and effective
        masses have the dimension `component` if the base motion has several components; they use the load mass.

        Raises:
            ValueError: If a part of the structure can move freely.
        """
        one = {name: values[None] for name, values in self.parameters.items()}
        influence = self.influence if self.influence.any() else np.ones((self.dofs, 1))
        found = modal_properties(
            self.mass_matrices(one)[0],
            self.stiffness_matrices(one)[0],
            influence[:, 0] if influence.shape[1] == 1 else influence,
            load_mass=self.load_masses(one)[0],
        )
        return found.assign_coords(dof=("dof", np.array(self.dof_names), {"long_name": "degree of freedom"}))

    @property
    def fundamental_period(self) -> float:
        """First period of the undamped structure [s]."""
        return float(self.modal()["period"][0])

    def __repr__(self) -> str:
        return (
            f"LumpedStructure({self.dofs} degrees of freedom, {len(self.springs)} springs, law={self.law!r}, "
            f"damping={self.damping!r})"
        )
