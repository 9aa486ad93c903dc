"""From a scene and its drawn parameters to the plain arrays a kernel reads, named as its structs name them."""

from __future__ import annotations

import numpy as np

from warpdyn.core.thread_pool import in_parts
from warpdyn.ground_motions.filtered_noise import FilteredNoise
from warpdyn.ground_motions.motions import Assignment, ForceHistory, FreeVibration, HarmonicForce
from warpdyn.integration.damping import (
    damper_kind,
    kernel_damping,
    storey_dashpots,
)
from warpdyn.integration.propagators import damping_of, pack_linear
from warpdyn.integration.time_grid import Schedule, Timeline
from warpdyn.kernels.build import fitted
from warpdyn.kernels.plan import MASS_DAMPED, Plan
from warpdyn.laws.devices.parameters import damper_values
from warpdyn.methods.table import METHODS
from warpdyn.scene.scatter import nominal_values
from warpdyn.scene.scene import Scene
from warpdyn.structures.modal import (
    chain_stiffness_matrix,
    modal_damping_matrix,
)
from warpdyn.structures.p_delta import stiffness_under_gravity, storey_weight_over_height

Arrays = dict[str, np.ndarray]
SORTED_BITS = 16  # of the durations that samples are sorted by


def parameters_of(scene: Scene, drawn: Arrays, structures: slice | np.ndarray = slice(None)) -> Arrays:
    """Return every parameter of some drawn structures, `structure` first; the one structure there is if none is drawn.

    Of a LinearSystem they are the factors on its matrices.
    """
    if drawn:
        count = len(next(iter(drawn.values()))[structures])
    else:
        count = structures.size if isinstance(structures, np.ndarray) else 1
    return {
        name: drawn[name][structures] if name in drawn else np.broadcast_to(value, (count, *value.shape))
        for name, value in nominal_values(scene.structure).items()
    }


def kernel_spring(scene: Scene) -> str:
    """Return the row of the kernels' SPRINGS table that holds for all structures that can be drawn."""
    return scene.structure.storey_law.spring({**scene.structure.parameters, **scene.representative_parameters})


def kernel_load(scene: Scene) -> str:
    """Return the row of the kernels' LOADS table."""
    if isinstance(scene.excitation, FilteredNoise):
        return scene.excitation.spectrum.load
    kinds = {HarmonicForce: "harmonic_force", ForceHistory: "force_history", FreeVibration: "free_vibration"}
    return kinds.get(type(scene.excitation), "base_acceleration")


def pack_chain(scene: Scene, parameters: Arrays, plan: Plan, rayleigh: np.ndarray) -> Arrays:
    """Return the arrays of the chain's kernels, structures last."""
    mass = parameters["mass"]
    structures, storeys = mass.shape
    # Structures are next to each other, as kernels have them and as they were drawn.
    coefficients = np.stack(
        [values.T for values in scene.structure.storey_law.coefficients(parameters, plan.law)], axis=1
    )
    packed = {
        "mass": mass.T,
        "inverse_mass": 1 / mass.T,
        "inverse_height": 1 / parameters["height"].T,
        "coefficients": coefficients.reshape(-1, structures),
    }
    dashpots = None
    if plan.damping != "rayleigh_tangent":
        dashpots = storey_dashpots(scene.structure, parameters, rayleigh[:, 1])
    if plan.viscous_dampers == "linear":
        dashpots = parameters["damper_coefficient"] + (0.0 if dashpots is None else dashpots)
    elif plan.viscous_dampers == "power":
        values = np.stack([values.T for values in damper_values(parameters)], axis=1)
        packed["viscous_damper"] = values.reshape(-1, structures)
    if dashpots is not None:
        packed["storey_damping"] = dashpots.T
    if plan.damping in MASS_DAMPED:
        packed["mass_damping"] = rayleigh[:, 0]
    if plan.damping == "rayleigh_tangent":
        packed["tangent_damping"] = rayleigh[:, 1]
    if plan.damping == "modal":
        matrix = chain_stiffness_matrix(stiffness_under_gravity(parameters))
        matrices = modal_damping_matrix(mass, matrix, parameters["damping_ratio"])
        packed["damping_matrix"] = matrices.reshape(structures, storeys * storeys).T
    if "gravity_load" in parameters:
        packed["storey_weight_over_height"] = storey_weight_over_height(parameters).T
    return packed


def pack_dense(scene: Scene, parameters: Arrays) -> Arrays:
    """Return the arrays of the dense kernel: the nominal matrices and the factors on them."""
    nominal = scene.structure.parameters
    return {
        "mass_matrix": nominal["mass"],
        "rate_of_displacement": np.linalg.solve(nominal["mass"], nominal["stiffness"]),
        "rate_of_velocity": np.linalg.solve(nominal["mass"], nominal["damping"]),
        "flexibility_of_mass": np.linalg.inv(nominal["mass"]),
        "influence": scene.structure.influence,
        **{f"{name}_factor": parameters[name] for name in nominal},
    }


def pack_structures(
    scene: Scene, parameters: Arrays, plan: Plan, step: np.ndarray | None, rayleigh: np.ndarray, threads: int = 1
) -> Arrays:
    """Return what the Structure struct of a plan's kernel holds.

    Args:
        scene: The scene.
        parameters: Every parameter of some structures, `structure` first.
        plan: The kernel's plan.
        step: Integration step of each of them [s], where `needs_step`.
        rayleigh: Rayleigh damping of each of them, as their vibration tells it.
        threads: CPU threads.
    """
    if needs_step(plan):
        return pack_linear(scene, parameters, plan, step)
    if plan.family == "dense":
        return pack_dense(scene, parameters)

    def part(structures: slice) -> Arrays:
        values = {name: array[structures] for name, array in parameters.items()}
        return pack_chain(scene, values, plan, rayleigh[structures])

    count = len(rayleigh)
    whole = {name: np.empty((*of_one.shape[:-1], count), plan.dtype) for name, of_one in part(slice(1)).items()}

    def fill(structures: slice) -> None:
        for name, values in part(structures).items():
            whole[name][..., structures] = values

    in_parts(fill, count, threads)
    return whole


def plan_of(scene: Scene, method: str, dtype: str, is_gpu: bool) -> Plan:
    """Return the plan of the kernel that integrates a scene."""
    family, dofs = scene.structure.family, scene.structure.dofs
    plan = Plan(
        family=family,
        dofs=dofs,
        law=kernel_spring(scene),
        damping=damping_of(scene) if METHODS[method].kind == "exact" else kernel_damping(scene.structure),
        load=kernel_load(scene),
        recorders=scene.recorders,
        method=method,
        dtype=dtype,
        viscous_dampers=damper_kind(scene),
        p_delta="gravity_load" in scene.structure.parameters and METHODS[method].kind != "exact",
    )
    return fitted(plan, is_gpu)


def needs_step(plan: Plan) -> bool:
    """Return whether what a kernel reads of a structure depends on the integration step."""
    kind = METHODS[plan.method].kind
    return kind == "exact" or (kind == "implicit" and plan.family == "dense")


def pack_samples(
    schedule: Schedule, assignment: Assignment, place: np.ndarray, columns: np.ndarray, number: np.ndarray | None = None
) -> tuple[Arrays, list[tuple[int, int]]]:
    """Return what the Samples struct holds, in the order in which samples are best launched.

    Args:
        schedule: How each sample is stepped.
        assignment: Its motion.
        place: Place of its structure among those packed, shape [sample].
        columns: Where in the outputs it is written, shape [sample].
        number: Its index in the run, shape [sample], where its motion depends on it.

    Returns:
        The arrays, and the steps an interval and the number of samples of each group that is launched by itself.
    """
    repeats = schedule.repeats  # samples in a row that are stepped alike are sorted as one
    run_intervals, substeps, step, residual_steps = (column[::repeats] for column in schedule.columns)
    # Longest first and neighbours alike: no thread waits long for another's last history.
    order = _longest_first(run_intervals)
    kinds = np.unique(substeps)
    parts = [order[substeps[order] == kind] for kind in kinds] if kinds.size > 1 else [order]
    order = np.concatenate(parts)
    common = {
        "structure": place[::repeats],
        "motion": assignment.motion[::repeats],
        "step": step,
        "run_intervals": run_intervals,
        "residual_steps": residual_steps,
    }
    own = {"output": columns, "scale": assignment.scale} | ({} if number is None else {"number": number})
    arrays = {name: np.repeat(values[order], repeats) for name, values in common.items()}
    arrays |= {name: values.reshape(-1, repeats)[order].ravel() for name, values in own.items()}
    return arrays, [(int(kind), part.size * repeats) for kind, part in zip(kinds, parts, strict=True)]


def _longest_first(durations: np.ndarray) -> np.ndarray:
    """Return the order of falling durations, of very different ones nearly so; neighbours that are equal stay so."""
    shorter = durations.max() - durations
    coarser = max(0, int(shorter.max()).bit_length() - SORTED_BITS)
    # Numbers of 16 bits are sorted without comparisons, in a tenth of the time.
    return np.argsort((shorter >> coarser).astype(np.uint16), kind="stable")


def pack_load(scene: Scene, timeline: Timeline) -> Arrays:
    """Return what the load's struct holds."""
    excitation, dofs = scene.excitation, scene.structure.dofs
    packed: Arrays = {
        "intervals": timeline.intervals,
        "initial_displacement": np.zeros(dofs),
        "initial_velocity": np.zeros(dofs),
    }
    if isinstance(excitation, HarmonicForce):
        packed["amplitude"] = excitation.amplitude
        packed["circular_frequency"] = np.array([excitation.circular_frequency])
        packed["phase"] = np.array([excitation.phase])
    elif isinstance(excitation, FreeVibration):
        packed["initial_displacement"] = np.broadcast_to(excitation.displacement, dofs)
        packed["initial_velocity"] = np.broadcast_to(excitation.velocity, dofs)
    elif isinstance(excitation, FilteredNoise):
        process = excitation.spectrum.recursion(excitation.interval)
        parts = [process.growth, process.kick, process.start, process.output, excitation.envelope_at_nodes()]
        packed["noise"] = np.concatenate([part.ravel() for part in parts])
    else:
        motions = timeline.motions
        packed["values"] = np.concatenate([motion.values.ravel() for motion in motions])
        lengths = [len(motion.values) for motion in motions]
        packed["first"] = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    return packed
