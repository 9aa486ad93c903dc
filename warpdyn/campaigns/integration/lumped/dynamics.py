"""Equations of motion of lumped structures: their vibration, and the arrays that kernels read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from warpdyn.campaigns.integration.dynamics import Arrays, Dynamics, Modes, slowest_decay
from warpdyn.campaigns.integration.lumped.rounding import LARGEST_ERROR, error_of_float32
from warpdyn.engine.kernels.lumped.pattern import OF_ENERGIES, PAIR, Pattern, Table, table_of, values_in
from warpdyn.engine.kernels.modes.damped_modes import damped_motions, damping_rate
from warpdyn.engine.kernels.output_table import HISTORY, OF_SPRINGS
from warpdyn.engine.laws.biaxial.functions import biaxial_functions
from warpdyn.engine.laws.building_law import BuildingLaw
from warpdyn.engine.laws.contacts.contact import Contact
from warpdyn.engine.laws.contacts.parameters import HertzContact
from warpdyn.engine.laws.elastic.parameters import Elastic
from warpdyn.engine.laws.ibarra_medina_krawinkler import branchless_rules, capped_rules
from warpdyn.engine.laws.springs import StoreyRules, Variant, number_of_coefficients
from warpdyn.engine.methods.stability_limits import (
    reads_eigenvalues,
    stable_step_of_eigenvalues,
    stable_step_of_worst,
    stable_step_of_yielding,
)
from warpdyn.engine.methods.state_matrices import highest_damping_rate
from warpdyn.engine.methods.table import Method
from warpdyn.engine.methods.undamped_modes import are_diagonal, inverses, squared_frequencies, undamped
from warpdyn.model.ground_motions.excitation import Excitation
from warpdyn.model.structures.lumped.biaxial_spring import BiaxialSpring
from warpdyn.model.structures.lumped.matrices import of_springs_only, without_rounding
from warpdyn.model.structures.lumped.structure import LumpedStructure

Variants = tuple[list[Variant], list[Variant]]
ROUNDED = 1e-14  # entries of an inverse matrix below this share of the largest one of their row and column are 0

MOST_DOFS_OF_IMPLICIT = 16  # the matrix of a step is full
# Default step of frames whose hinges soften beyond a capping moment, over that of other structures. A hinge reaches its
# capping moment within a step, and near collapse the error that this causes grows: the peak drift of a frame with two
# storeys was 1.4 % wrong at 5 ms, the step without this factor, 0.04 % at 3.3 ms and at most 0.5 % at shorter steps.
SHARE_OF_SOFTENING_HINGES = 0.5


class LumpedDynamics(Dynamics):
    """The equation of motion of lumped structures; arguments and attributes: see Dynamics."""

    structure: LumpedStructure
    viscous_dampers, physics = "none", ()
    steps_modes, couples_modes, needs_eigenvalues, is_checked_by_vibration = False, True, True, True
    histories = (*(name for name in HISTORY if name != "storey_force"), *OF_SPRINGS)
    peak = ("peak_spring_deformation", "spring")

    def __init__(self, structure: LumpedStructure, representative: Mapping[str, np.ndarray]) -> None:
        super().__init__(structure, representative)
        values = of_springs_only({**structure.parameters, **representative})
        self.springs, self.pairs = laws_of(structure)
        self.law_rows = _as_range(rows_of_laws(structure))
        self.biaxial_law: StoreyRules | None = None
        of_springs = self._of(self.springs, values)
        self.law, self.variants = self.springs.rules(of_springs), self.springs.variants(of_springs)
        if self.pairs is not None:
            of_pairs = self._of(self.pairs, values)
            self.biaxial_law, self.biaxial_variants = self.pairs.rules(of_pairs), self.pairs.variants(of_pairs)
        couples_rates = self.biaxial_law is not None and biaxial_functions(self.biaxial_law).rate is not None
        of_storeys = structure.storey_law.forces()
        self.forces = replace(
            of_storeys,
            is_chain=False,
            is_lumped=True,
            couples_rates=couples_rates,
            refuses_implicit=self._refuses_implicit(),
        )
        self.counts_reversals = structure.storey_law.counts_reversals(values)
        if structure.column_line is not None:
            # Rotations of hinges are unknowns, not differences of displacements. Measured errors of float32 with
            # deteriorating hinges: up to 1.5e-5 of the peak drift, at drift ratios up to 8 %.
            self.counts_reversals = False
            if isinstance(self.law, Variant) and str(self.law) == capped_rules.GENERAL:
                is_capped = capped_rules.applies(of_springs, representative)  # reads the first coefficients
                self.law = capped_rules.variant() if is_capped else branchless_rules.variant(self.law)
        self.is_sensitive = structure.storey_law.is_sensitive(values)
        if structure.column_line is not None and self.is_sensitive:
            self.share_of_default_step = SHARE_OF_SOFTENING_HINGES
        self.has_drift_capacity = "deformation_capacity" in structure.parameters
        self.damping = "mass_proportional" if structure.damping in ("rayleigh", "mass_proportional") else "none"
        self.pattern = self._pattern_of(representative)
        error = error_of_float32(structure)
        self.error_of_float32 = error if error > LARGEST_ERROR else 0.0

    def _refuses_implicit(self) -> str:
        """Return why implicit methods do not support the structure; "" if they do."""
        if self.structure.dofs > MOST_DOFS_OF_IMPLICIT:
            dofs = self.structure.dofs
            return f"implicit methods support at most {MOST_DOFS_OF_IMPLICIT} degrees of freedom, not {dofs}"
        if self.structure.column_line is not None:
            return "implicit methods do not support frames with hinges, whose rotations have no mass"
        for spring in self.structure.given_springs:
            if isinstance(spring, BiaxialSpring):
                return f"implicit methods do not support biaxial springs, such as {spring.name!r}"
            if issubclass(spring.law, Contact) and not issubclass(spring.law, HertzContact):
                return (
                    "implicit methods do not support contacts whose force depends on the rate of deformation, such as "
                    f"{spring.law.name!r} of spring {spring.name!r}"
                )
        return ""

    def _pattern_of(self, representative: Mapping[str, np.ndarray]) -> Pattern:
        """Return the pattern of all structures that may be drawn."""
        structure = self.structure
        # Entries that are equal for unequal masses are equal in each structure, also if each mass is drawn.
        random = np.random.default_rng(0)
        parameters: Arrays = {}
        for name, value in structure.nominal_values.items():
            rows = [value, value, value]
            if name in representative:
                values = np.asarray(representative[name])
                low, high = values.min(axis=0), values.max(axis=0)
                # A nominal value of 0, such as that of an eccentricity, is not the value of any drawn structure.
                between = low + random.uniform(0.1, 0.9, value.shape) * (high - low)
                rows = [low, high, np.where(value == 0, between, random.uniform(0.9, 1.1, value.shape) * value)]
            elif name == "mass" and structure.column_line is not None:
                # Frames with random and with given masses then have one kernel, which compiles slowly.
                rows = [value, value, random.uniform(0.9, 1.1, value.shape) * value]
            parameters[name] = np.stack([np.broadcast_to(row, value.shape) for row in rows])
        if structure.problem(parameters):  # drawing the structures raises an error that names the value
            parameters = {name: values[2:] for name, values in parameters.items()}
        elastic = structure.mass_matrices(parameters), structure.stiffness_matrices(parameters)
        rayleigh = structure.rayleigh(parameters, np.sqrt(undamped(*elastic)[0]))
        matrices = self._matrices(parameters, rayleigh)
        tables = {
            name: table_of(
                matrix,
                has_signs=name != "damping",  # modes decide the signs in a matrix of modal damping
                may_be_computed=name in ("stiffness", "damping", "output"),
                is_symmetric=name != "output",
            )
            for name, matrix in matrices.items()
        }
        for name in ("stiffness", "damping", "unmoved"):
            if tables[name].is_empty:
                tables[name] = Table()
        is_damped = "damping_coefficient" in parameters or structure.damping in ("rayleigh", "stiffness_proportional")
        line = structure.column_line  # its damping acts on floors
        return Pattern(
            deformation=tables.pop("deformation"),
            inverse_mass=tables.pop("inverse_mass"),
            components=structure.components,
            has_dashpots=is_damped and line is None,
            pairs=structure.pairs,
            biaxial_law=self.biaxial_law,
            resultants=structure.resultants,
            line=line,
            storeys=structure.storey_springs,
            **tables,
        )

    def _of(self, law: BuildingLaw, values: Mapping[str, np.ndarray]) -> Arrays:
        """Return the parameters of the springs, or of the biaxial springs, that have these laws."""
        first = len(self.structure.springs) - PAIR * self.structure.pairs
        rows = self.law_rows if law is self.springs else slice(first, None, PAIR)
        by_spring = self.structure.is_by_storey
        # The transpose, so that values of successive structures stay contiguous in memory.
        return {name: each.T[rows].T if by_spring(name) else each for name, each in values.items()}

    def _coefficients(self, law: BuildingLaw, parameters: Arrays, variants: Variants) -> np.ndarray:
        """Return the coefficients of the laws of springs, shape [spring x coefficient, structure]."""
        values = self._of(law, of_springs_only(parameters))
        shape = values["stiffness"].shape
        read, springs = law.coefficients(values, variants), shape[1]
        rows: slice | list[int] = slice(None)
        if law is self.springs and self.structure.column_line is not None:  # other springs have coefficients of 0
            read, rows = read[: number_of_coefficients(self.law)], self.law_rows
            springs = len(self.structure.springs)
        found = np.zeros((springs, len(read), shape[0]))
        for index, each in enumerate(read):
            found[rows, index] = np.broadcast_to(each, shape).T
        return found.reshape(-1, shape[0])

    def _matrices(self, parameters: Arrays, rayleigh: np.ndarray) -> dict[str, np.ndarray]:
        """Return the matrices of the kernel by the names of the pattern's tables, shape [structure, row, column]."""
        structure, count = self.structure, len(parameters["mass"])
        mass = structure.mass_matrices(parameters)
        inverse = inverses(mass)
        if not are_diagonal(inverse).all():
            inverse = without_rounding((inverse + inverse.transpose(0, 2, 1)) / 2, ROUNDED)
        elastic = structure.linear_matrices(parameters) - structure.geometric_matrices(parameters)
        outputs = structure.output_matrices(parameters)
        influence = structure.influences(parameters)
        drive = influence
        if structure.load_mass is not None:
            drive = inverse @ structure.load_masses(parameters) @ influence
            drive = _near(drive, influence)
        return {
            "deformation": np.broadcast_to(structure.directions, (count, *structure.directions.shape)),
            "inverse_mass": inverse,
            "stiffness": np.broadcast_to(elastic, mass.shape),
            "damping": structure.damping_between_dofs(parameters, rayleigh),
            "drive": drive,
            "unmoved": influence - drive,
            "mass": mass,
            "pull": structure.load_masses(parameters) @ influence,
            "output": np.broadcast_to(outputs, (count, *outputs.shape[1:])),
        }

    def _vibration(self, parameters: Arrays, method: Method, *, has_decay: bool = True) -> tuple[np.ndarray, ...]:
        structure = self.structure
        mass, elastic = structure.mass_matrices(parameters), structure.stiffness_matrices(parameters)
        shapes = None
        if has_decay:
            squared, shapes = undamped(mass, elastic)
        else:
            squared = np.maximum(squared_frequencies(mass, elastic), 0.0)
        frequency = np.sqrt(squared)
        rayleigh = structure.rayleigh(parameters, frequency)
        damping = structure.damping_matrices(parameters, rayleigh)
        if shapes is None:
            decay, rate = np.full(len(mass), np.nan), damping_rate(mass, damping)
            stable = stable_step_of_worst(method, frequency[:, -1], rate)
        else:
            eigenvalues, rate = damped_motions(mass, damping, elastic, squared, shapes)
            decay = slowest_decay(eigenvalues)
            stable = stable_step_of_eigenvalues(method, eigenvalues, frequency[:, -1], rate)
        if not self.forces.is_linear:
            law, of_springs = structure.storey_law, of_springs_only(parameters)
            highest, stiffest = frequency[:, -1], law.stiffest(of_springs)
            stiffens = (stiffest != parameters["stiffness"]).any(axis=-1)
            if stiffens.any():  # the others keep their bits
                tangent = structure.stiffness_matrices(parameters, stiffest)
                of_tangent = np.sqrt(np.maximum(squared_frequencies(mass, tangent)[:, -1], 0.0))
                highest = np.where(stiffens, of_tangent, highest)
            if any(issubclass(each, Contact) for each in law.laws):
                # The mass that a spring moves if its ends are free, such as m1 m2 / (m1 + m2) between two masses.
                rows = structure.directions
                moved = 1 / np.einsum("ki,sij,kj->sk", rows, np.linalg.inv(mass), rows, optimize=True)
                of_springs = {**of_springs, "mass": moved}
            steepest = law.steepest_damping(of_springs)
            if steepest.any():
                rate = highest_damping_rate(mass, damping + structure.of_springs(steepest))
            rate = np.maximum(rate, law.relaxation_rate(of_springs).max(axis=-1))
            stable = stable_step_of_yielding(method, highest, rate, stable)
        return 2 * np.pi / frequency[:, 0], decay, stable, rayleigh.T

    def _without_decay(self, parameters: Arrays, method: Method) -> tuple[np.ndarray, ...]:
        return self._vibration(parameters, method, has_decay=reads_eigenvalues(method))

    def modes(self, parameters: Arrays, excitation: Excitation, *, is_coupled: bool) -> Modes:
        """Raise an error: no method of lumped structures integrates modes."""
        raise NotImplementedError("lumped structures are not integrated by modes")

    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> Arrays:
        """Return the arrays of the kernel; the last dimension is the structure."""
        structures, of_structure = len(parameters["mass"]), self.structure
        coefficients = self._coefficients(self.springs, parameters, self.variants)
        matrices = self._matrices(parameters, rayleigh.T)
        assert self.pattern is not None
        tables = self.pattern.tables
        terms = [values_in(table, matrices[name]) for name, table in tables.items()]
        if self.pattern.has_dashpots:
            terms.insert(len(tables) - len(OF_ENERGIES), of_structure.dashpots(parameters, rayleigh.T).T)
        if self.pairs is not None:
            of_pairs = self._coefficients(self.pairs, parameters, self.biaxial_variants)
            terms.insert(len(terms) - len(OF_ENERGIES), of_pairs)
        if self.pattern.line is not None:
            terms.insert(len(terms) - len(OF_ENERGIES), of_structure.values_of_line(parameters))
        whole = np.concatenate(terms)
        packed = {
            "coefficients": coefficients if len(coefficients) else np.zeros((1, structures)),
            "terms": whole if len(whole) else np.zeros((1, structures)),
        }
        if "height" in parameters:
            packed["inverse_height"] = 1 / parameters["height"].T
        if self.has_drift_capacity:
            with np.errstate(invalid="ignore"):
                packed["inverse_drift_capacity"] = np.nan_to_num(1 / parameters["deformation_capacity"].T)
        return packed | ({"mass_damping": rayleigh[:, 0]} if self.damping == "mass_proportional" else {})


def laws_of(structure: LumpedStructure) -> tuple[BuildingLaw, BuildingLaw | None]:
    """Return the laws of the springs and those of the biaxial springs; None without biaxial springs."""
    rows = rows_of_laws(structure)
    if isinstance(rows, list):
        return BuildingLaw([structure.storey_law.of_storeys[row] for row in rows]), None
    if not structure.pairs:
        return structure.storey_law, None
    laws, first = structure.storey_law.of_storeys, len(structure.springs) - PAIR * structure.pairs
    return BuildingLaw(laws[:first] or (Elastic,)), BuildingLaw(laws[first::PAIR])


def rows_of_laws(structure: LumpedStructure) -> slice | list[int]:
    """Return the springs, other than biaxial ones, whose laws a kernel evaluates.

    Of a fish-bone frame with hinges these are the hinges that are not linear. If all are linear, the first spring is
    returned.
    """
    line = structure.column_line
    if line is None:
        return slice(len(structure.springs) - PAIR * structure.pairs)
    return [spring for spring in line.springs if spring >= 0 and spring not in line.linear] or [0]


def _as_range(rows: slice | list[int]) -> slice | list[int]:
    """Return indices as a slice, which copies no values, if they follow one another."""
    if isinstance(rows, list) and rows == list(range(rows[0], rows[0] + len(rows))):
        return slice(rows[0], rows[0] + len(rows))
    return rows


def _near(values: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return values, replaced by others from which they differ only by rounding."""
    rounding = 1e-12 * np.abs(others).max()
    return np.where(np.abs(values - others) <= rounding, others, values)
