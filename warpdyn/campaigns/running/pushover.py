"""Quasi-static analysis: storey hysteresis and pushover, by the storey laws of the kernels."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.campaigns.running.pushing.chain import PushedChain
from warpdyn.campaigns.running.pushing.loads import control_dof, dof_loads
from warpdyn.campaigns.running.pushing.loops import given_sets, loops_along
from warpdyn.campaigns.running.pushing.search import pushed_along
from warpdyn.campaigns.running.pushing.structure import PushedStructure
from warpdyn.engine.laws.springs import StoreyRules
from warpdyn.foundations.core.checks import check_kind, check_memory, finite_numbers
from warpdyn.foundations.core.description import to_json
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.files.netcdf import trace
from warpdyn.model.scene.scatter import Scatter
from warpdyn.model.structures.lateral_loads import floor_loads, storey_shears
from warpdyn.model.structures.lumped.biaxial_spring import BiaxialSpring
from warpdyn.model.structures.lumped.matrices import of_springs_only
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.physics import effective_stiffness
from warpdyn.model.structures.shear_building import ShearBuilding

BYTES_OF_A_FORCE = 64  # of a force and an energy: kernel results, their parts of steps, and copies in the dataset
GIVEN_LOADS = "given"  # name of the pattern if the caller gives floor loads
STEP = {"units": "1", "long_name": "step of the path"}
BASE_SHEAR = {"units": "N", "long_name": "sum of the lateral loads"}
DISSIPATED = {"units": "J", "long_name": "work done less what is stored"}


def spring_and_coefficients(building: ShearBuilding | LumpedStructure) -> tuple[StoreyRules, np.ndarray]:
    """Return the device functions of the storeys or springs, and their coefficients, shape [coefficient, storey]."""
    values = of_springs_only(building.parameters) if isinstance(building, LumpedStructure) else building.parameters
    parameters = {name: np.atleast_1d(value)[None] for name, value in values.items()}
    law = building.storey_law
    coefficients = np.concatenate(np.broadcast_arrays(*law.coefficients(parameters)))
    return law.rules(parameters), np.ascontiguousarray(coefficients, np.float64)


def _warn_of_implausible_path(drift_ratio: np.ndarray) -> None:
    """Warn if drift ratios [1] are so large that the drifts were probably given in another unit than m."""
    findings = PlausibilityFindings()
    findings.add("pushed_drift_ratio", np.abs(drift_ratio).max())
    findings.warn()


@suggests_names
def storey_hysteresis(building: ShearBuilding, drift: ArrayLike, *, scatter: Scatter | None = None) -> xr.Dataset:
    """Return the forces of a building's storeys under prescribed quasi-static drifts (hysteresis), in float64.

    Args:
        building: The building.
        drift: Storey drifts [m], starting from 0. Shape [step]: all storeys have the same drift; or [step, storey].
            Bouc-Wen and Baber-Noori storeys are integrated in parts of a step of at most 0.25 yield drifts.
        scatter: Parameter sets: GivenValues or GivenFactors of parameters, one row per structure. As many structures
            are possible as their results fit into the memory. None: the parameters of the building.

    Returns:
        `storey_drift` [m], `storey_force` [N] and `dissipated_energy` [J], all of shape [step, storey]; with `scatter`,
        the last two have the shape [structure, step, storey]. The dissipated energy is the work done (trapezoidal rule)
        less the stored energy. The attribute `building` is the building as JSON.

    Raises:
        ValueError: If a drift is not finite, the shape is wrong, or values of `scatter` are out of their bounds or
            differ in their number of structures.
        TypeError: If `building` is not a ShearBuilding, or a scatter is random.

    Example:
        >>> cycle = wd.storey_hysteresis(building, [0.0, 0.01, -0.01, 0.0])
        >>> (cycle["storey_force"] / 1e3).round().values  # kN
        array([[   0.,    0.],
               [ 305.,  205.],
               [-305., -205.],
               [  95.,   95.]])
        >>> strengths = {"yield_force": wd.GivenValues([[2e5, 1e5], [3e5, 2e5], [4e5, 3e5]])}
        >>> wd.storey_hysteresis(building, [0.0, 0.01], scatter=strengths)["storey_force"].dims
        ('structure', 'step', 'storey')
    """
    check_kind("storey_hysteresis", "a ShearBuilding", building, ShearBuilding, _advice(building), argument="building")
    path = finite_numbers("drift", drift)
    if path.ndim == 1:
        path = np.repeat(path[:, None], building.storeys, axis=1)
    if path.ndim != 2 or path.shape[1] != building.storeys or not path.size:
        raise ValueError(f"drift must have shape [step] or [step, {building.storeys}], got {np.shape(drift)}")
    _warn_of_implausible_path(path / building.parameters["height"])
    title = "forces of storeys at given drifts"
    if scatter is not None:
        return _of_sets(building, path, scatter, title)
    force, dissipated = loops_along(building, building.parameters, path)
    return _storey_dataset(building, path, force[0], dissipated[0], title, "storey_hysteresis")


def _of_sets(building: ShearBuilding, path: np.ndarray, scatter: Scatter, title: str) -> xr.Dataset:
    """Return the result of `storey_hysteresis` for many parameter sets; arguments as there."""
    values = given_sets("storey_hysteresis", building, scatter)
    count = len(next(iter(values.values())))
    check_memory(
        f"storey_hysteresis of {count:,} parameter sets with {len(path):,} drifts",
        BYTES_OF_A_FORCE * path.size * count,
        "give fewer sets at a time",
    )
    force, dissipated = loops_along(building, {**building.parameters, **values}, path, count)
    dims, number = ("structure", "step", "storey"), {"units": "1", "long_name": "parameter set, from 0"}
    made = _storey_dataset(building, path, force[0], dissipated[0], title, "storey_hysteresis")
    results: dict[str, tuple] = {
        "storey_force": (dims, force, made["storey_force"].attrs),
        "dissipated_energy": (dims, dissipated, DISSIPATED),
    }
    for name, each in values.items():
        parameter = building.parameter_table[name]
        results[name] = (("structure", "storey"), each, {"units": parameter.units, "long_name": parameter.long_name})
    return made.assign(results).assign_coords(structure=("structure", np.arange(count, dtype=np.int32), number))


@suggests_names
def pushover(
    building: ShearBuilding | LumpedStructure,
    roof_displacement: ArrayLike,
    *,
    pattern: str | Mapping[str, float] | ArrayLike = "first_mode",
    control: str | None = None,
) -> xr.Dataset:
    """Run a pushover analysis: push a building quasi-statically by lateral loads of one pattern.

    The roof displacement is prescribed and the base shear follows, so that a building can be pushed beyond its peak
    strength. Within a step the drift of each storey changes in one direction only, and a step is divided at the point
    at which a storey begins to soften (lose strength). From then on one storey softens and the others unload. An
    equilibrium is a minimum of the work; it is searched from elastic drift increments, or from the increments of the
    last step. Viscous damping has no effect. With a gravity load (P-Delta) the lateral load is the resistance of the
    springs minus the P-Delta force, and may be negative.

    A lumped structure is pushed in the same way, by loads on its degrees of freedom: springs take the place of storeys,
    and one degree of freedom (`control`) that of the roof. Its equilibria are found by Newton's method. An equilibrium
    counts if it is stable at the prescribed displacement: the tangent stiffness has no negative eigenvalue, or one and
    the base shear falls. The massless displacements of a HingedFishbone or a HingedFrame are unknowns like the
    displacements of its floors. Gravity loads act from the start: their P-Delta effect, and in a HingedFrame also the
    moments of hinges, which may yield. Displacements and storey drifts are relative to this state.

    Drift capacities of storeys and deformation capacities of springs are not considered.

    Args:
        building: The building or lumped structure.
        roof_displacement: Roof displacements [m], starting from 0, shape [step]; they may reverse. For Bouc-Wen
            storeys, use steps that are short compared with the yield displacement. For a lumped structure the
            displacements of the degree of freedom `control` [m, rad for a rotation].
        pattern: "first_mode" (floor mass times first mode), "triangular" (floor mass times height above the ground),
            "uniform" (floor mass), or floor loads of any scale [1], shape [floor]. For a lumped structure "first_mode"
            (load mass times first mode), "triangular" (load mass times height, only of frames), "uniform" (load mass
            times influence, only with one component of base motion), or loads of any scale, {degree of freedom: load}
            or shape [dof].
        control: Name of the degree of freedom of a lumped structure whose displacement is prescribed; None: the
            translation with the largest positive displacement under the loads in elastic equilibrium.

    Returns:
        `roof_displacement` [m] and `base_shear` [N] (sum of the lateral loads), shape [step]; `storey_drift` [m],
        `storey_force` [N] of the springs and `dissipated_energy` [J], defined as in `storey_hysteresis`, shape [step,
        storey]; `floor_load` [1], the share of each floor in the base shear, shape [floor]. The attribute `building` is
        the building as JSON, and the attribute `pattern` is the name of the pattern ("given" for floor loads). If no
        equilibrium is found in a step, the curve ends at the last equilibrium, whose roof displacement lies within that
        step. Then a warning and the attribute `stopped_because` report the roof displacement and the reason.

        Of a lumped structure: `spring_deformation`, `spring_force` and `dissipated_energy`, shape [step, spring],
        instead of those of storeys; `displacement`, shape [step, dof]; `dof_load`, the loads over the base shear, shape
        [dof]. The base shear is the sum of the loads times the displacements under a unit displacement of the base, in
        the component of base motion in which it is largest. The attributes `control` and `component` (counted from 1)
        report the choices. The first springs of a frame with hinges are its storeys: `spring_force` is the shear of
        their columns and braces, and `dissipated_energy` is 0, because hinges dissipate the energy.

    Raises:
        ValueError: If a displacement is not finite, or the pattern is unknown, negative or without a load on the roof;
            for a lumped structure, if a name is unknown, the loads have no resultant in the direction of a base motion,
            the structure has biaxial springs, or its equilibrium under gravity loads is unstable.
        RuntimeError: If no equilibrium is found at all, also not under the gravity loads.
        TypeError: If `building` is neither a ShearBuilding nor a LumpedStructure.

    Example:
        >>> pushed = wd.pushover(building, np.linspace(0.0, 0.1, 101))
        >>> (pushed["base_shear"][::25] / 1e3).round().values  # kN
        array([  0., 315., 342., 368., 395.])
    """
    if not isinstance(building, LumpedStructure):
        check_kind("pushover", "a ShearBuilding or a LumpedStructure", building, ShearBuilding, argument="building")
    path = finite_numbers("roof_displacement", roof_displacement)
    if path.ndim != 1 or not path.size:
        raise ValueError(f"roof_displacement must have shape [step], got {np.shape(roof_displacement)}")
    if isinstance(building, LumpedStructure):
        return _pushed_structure(building, path, pattern, control)
    if control is not None:
        raise ValueError("control= names a degree of freedom of a lumped structure: omit it for a ShearBuilding")
    if isinstance(pattern, Mapping):
        raise ValueError("pattern must be one load per floor of a ShearBuilding: give a list, from the ground up")
    parameters = building.parameters
    loads = floor_loads(pattern, parameters["mass"], parameters["height"], effective_stiffness(parameters))
    _warn_of_implausible_path(path / parameters["height"].sum())
    pushed = pushed_along(PushedChain(building, storey_shears(loads), *spring_and_coefficients(building)), path)
    made = _storey_dataset(
        building, pushed.drift, pushed.force, pushed.dissipated, "building pushed slowly by lateral loads", "pushover"
    )
    floors = np.arange(1, building.storeys + 1, dtype=np.int32)
    along = {"units": "m", "long_name": "roof displacement"}
    return (
        made.assign_coords(floor=("floor", floors, {"units": "1", "long_name": "floor above the storey"}))
        .assign(
            roof_displacement=("step", pushed.prescribed, along),
            base_shear=("step", pushed.base_shear, BASE_SHEAR),
            floor_load=("floor", loads, {"units": "1", "long_name": "lateral load over the base shear"}),
        )
        .assign_attrs(pushed.stopped | {"pattern": pattern if isinstance(pattern, str) else GIVEN_LOADS})
    )


def _pushed_structure(
    structure: LumpedStructure, path: np.ndarray, pattern: str | Mapping[str, float] | ArrayLike, control: str | None
) -> xr.Dataset:
    """Return the result of `pushover` for a lumped structure; arguments as there."""
    if structure.pairs:
        name = next(each.name for each in structure.given_springs if isinstance(each, BiaxialSpring))
        raise ValueError(
            f"pushover(): biaxial spring {name!r} is not supported: replace it by two springs, or simulate the "
            "structure under forces that increase slowly, wd.ForceHistory(values, step)"
        )
    loads, component = dof_loads(structure, pattern)
    place = control_dof(structure, loads, control)
    if structure.storeys and not structure.kinds.rotating["dof"][place]:
        _warn_of_implausible_path(path / structure.parameters["height"].sum())
    pushed = pushed_along(PushedStructure(structure, loads, place, *spring_and_coefficients(structure)), path)
    steps, units = np.arange(len(pushed.base_shear), dtype=np.int32), structure.kinds.units
    shears = structure.forces_of_gauges(pushed.displacement)
    force = np.concatenate([shears, pushed.force[:, shears.shape[1] :]], axis=1)
    of_springs, dof = ("step", "spring"), structure.dof_names[place]
    along = {"units": "rad" if structure.kinds.rotating["dof"][place] else "m", "long_name": f"displacement of {dof}"}
    return xr.Dataset(
        {
            "roof_displacement": ("step", pushed.prescribed, along),
            "base_shear": ("step", pushed.base_shear, BASE_SHEAR),
            "displacement": (
                ("step", "dof"),
                pushed.displacement[:, : structure.dofs],
                {"units": units("dof", "m"), "long_name": "displacement"},
            ),
            "spring_deformation": (
                of_springs,
                pushed.drift,
                {"units": units("spring", "m"), "long_name": "deformation of the spring"},
            ),
            "spring_force": (
                of_springs,
                force,
                {"units": units("spring", "N"), "long_name": "restoring force of the spring"},
            ),
            "dissipated_energy": (of_springs, pushed.dissipated, DISSIPATED),
            "dof_load": ("dof", loads, {"units": "1", "long_name": "load over the base shear"}),
        },
        coords={"step": ("step", steps, STEP), **structure.numbered(())},
        attrs=trace("structure pushed slowly by loads", "pushover")
        | {"building": to_json(structure), "control": dof, "component": component + 1}
        | pushed.stopped
        | {"pattern": pattern if isinstance(pattern, str) else GIVEN_LOADS},
    )


def _storey_dataset(
    building: ShearBuilding, drift: np.ndarray, force: np.ndarray, dissipated: np.ndarray, title: str, function: str
) -> xr.Dataset:
    dims, storey = ("step", "storey"), {"units": "1", "long_name": "storey, from the ground up"}
    return xr.Dataset(
        {
            "storey_drift": (dims, drift, {"units": "m", "long_name": "storey drift"}),
            "storey_force": (dims, force, {"units": "N", "long_name": "restoring force of the storey"}),
            "dissipated_energy": (dims, dissipated, DISSIPATED),
        },
        coords={
            "step": ("step", np.arange(len(drift), dtype=np.int32), STEP),
            "storey": ("storey", np.arange(1, drift.shape[1] + 1, dtype=np.int32), storey),
        },
        attrs=trace(title, function) | {"building": to_json(building)},
    )


def _advice(building: object) -> str:
    """Return what to do with a lumped structure, or ""."""
    is_lumped = isinstance(building, LumpedStructure)
    return "push a lumped structure, wd.pushover(structure, displacements)" if is_lumped else ""
