"""Misfit of many candidates of a storey law to a measured force-displacement loop."""

from __future__ import annotations

import numpy as np
import warp as wp

from warpdyn.campaigns.inference.measured import MeasuredLoop
from warpdyn.campaigns.inference.priors import Values
from warpdyn.campaigns.integration.settings import Execution
from warpdyn.engine.kernels.auxiliary.loop_misfit import loop_misfit_kernel
from warpdyn.engine.kernels.kernel_cache import block_size, initialise, loaded
from warpdyn.engine.laws.devices.parameters import ViscousDamper
from warpdyn.foundations.core.thread_pool import in_parts
from warpdyn.model.structures.shear_building import ShearBuilding

LONGEST_STEP = 0.25  # longest step of a law whose memory follows a differential equation [yield drifts] ...
LONGEST_RELAXATION = 0.5  # ... and [decays of a deviation of its memory]
MOST_STEPS = 1_000_000  # of a candidate along the loop


class LoopMisfit:
    """Differences of the forces of candidates from those of a measured loop.

    Args:
        storey: The storey, with the nominal values of all parameters.
        loop: The measured loop.
        execution: Devices and threads.

    Raises:
        ValueError: If the storey has a device whose force depends on the velocity, and the loop has no velocity; or if
            the building has several storeys.
    """

    def __init__(self, storey: ShearBuilding, loop: MeasuredLoop, execution: Execution) -> None:
        if storey.storeys != 1:
            raise ValueError(
                f"a MeasuredLoop is the loop of one storey, but the building has {storey.storeys} storeys: give a law, "
                "or a ShearBuilding of one storey"
            )
        self.has_damper = ViscousDamper.name in storey.devices
        if self.has_damper and loop.velocity is None:
            raise ValueError(
                "the storey has a viscous damper, whose force depends on the velocity: give "
                "MeasuredLoop(drift, force, velocity=...) [m/s]"
            )
        if loop.velocity is not None and not self.has_damper:
            raise ValueError(
                "the loop has velocities, but the storey has no viscous damper: add devices=('viscous_damper',) to a "
                "ShearBuilding of one storey, or remove velocity="
            )
        if storey.storey_law.forces().relaxes:
            raise ValueError(
                f"calibrate: the force of {storey.law} depends on time at a constant drift, which a loop without time "
                "does not determine: measure a response history, wd.MeasuredResponse"
            )
        self.storey, self.loop, self.execution = storey, loop, execution
        self.count = loop.drift.size - loop.first
        self.devices = execution.devices[:1]
        initialise()

    def __call__(self, values: Values) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the sums of differences and of their squares, [candidate, 1], and the peak computed forces [N]."""
        count = len(next(iter(values.values())))
        nominal = {name: np.broadcast_to(each, (count, 1)) for name, each in self.storey.parameters.items()}
        p = {**nominal, **{name: each.reshape(count, 1) for name, each in values.items()}}
        law = self.storey.storey_law
        variants = law.variants(p)
        kernel = loaded(loop_misfit_kernel(law.rules(p), has_damper=self.has_damper), self.devices[0])
        coefficients = np.concatenate(np.broadcast_arrays(*law.coefficients(p, variants)), axis=1).T
        longest = self._longest_steps(p)
        damper = np.zeros((3, count))
        if self.has_damper:
            damper = np.stack([p[name][:, 0] for name in ViscousDamper.parameters])
            damper[1] -= 1.0
        found = np.full((3, count), np.nan)

        def compare(part: slice) -> None:
            found[:, part] = self._launch(kernel, coefficients[:, part], longest[part], damper[:, part])

        is_cpu = self.devices[0] == "cpu"
        threads = self.execution.cores if is_cpu else 1
        in_parts(compare, count, threads, max(64, -(-count // (4 * threads))) if is_cpu else max(count, 1))
        return found[0][:, None], found[1][:, None], found[2]

    def _launch(
        self, kernel: wp.Kernel, coefficients: np.ndarray, longest: np.ndarray, damper: np.ndarray
    ) -> np.ndarray:
        """Return sums, sums of squares and peaks of some candidates, shape [3, candidate]."""
        device, loop = self.devices[0], self.loop
        velocity = np.zeros_like(loop.drift) if loop.velocity is None else loop.velocity
        rows = coefficients, longest, damper, loop.drift, velocity, loop.force
        given: list[wp.array] = [wp.array(np.ascontiguousarray(each), dtype=wp.float64, device=device) for each in rows]
        results = [wp.full(longest.size, np.nan, dtype=wp.float64, device=device) for _ in range(3)]
        inputs = [*given, loop.first]
        wp.launch(kernel, dim=longest.size, inputs=inputs, outputs=results, device=device, block_dim=block_size(device))
        return np.stack([result.numpy() for result in results])

    def _longest_steps(self, p: Values) -> np.ndarray:
        """Return the longest change of the drift in one step of the law [m], shape [candidate]."""
        count = len(p["stiffness"])
        if not self.storey.storey_law.forces().has_rate or "yield_force" not in p:
            return np.full(count, np.inf)
        steps = LONGEST_STEP * np.ones((count, 1))
        if "exponent" in p and "beta" in p:
            # The relaxation rate is n (beta + |gamma|) |z|^(n - 1), at most with |z|^n = 1 / (beta + gamma).
            n, beta, gamma = p["exponent"], p["beta"], p["gamma"]
            rate = n * (beta + np.abs(gamma)) * (beta + gamma) ** (1 / n - 1)
            steps = np.minimum(steps, LONGEST_RELAXATION / rate)
        longest = (steps * p["yield_force"] / p["stiffness"])[:, 0]
        travelled = np.abs(np.diff(self.loop.drift, prepend=0.0)).sum()
        if (most := travelled / longest.min()) > MOST_STEPS:
            raise ValueError(
                f"MeasuredLoop.drift: the path needs {most:.3g} steps of the shortest candidate, more than "
                f"{MOST_STEPS:,}: give drifts in m, or narrower priors of yield_force, stiffness and exponent"
            )
        return longest
