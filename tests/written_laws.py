"""Laws and devices as users write them."""

from typing import Any

import warp as wp

import warpdyn as wd
from warpdyn.engine.laws import DEVICES, LAWS


class Kinematic(wd.laws.Law):
    """A bilinear storey, as `wd.laws.Bilinear`.

    Example:
        >>> Kinematic(yield_force=1e5, hardening_ratio=0.05)
        Kinematic(yield_force=100000.0, hardening_ratio=0.05)
    """

    yield_force: float = wd.laws.shared(wd.laws.YIELD_FORCE)
    hardening_ratio: float = wd.laws.shared(wd.laws.HARDENING_RATIO)

    memory = ("plastic",)
    is_linear_until_yield = True

    @staticmethod
    def derived(p):
        stiffness, ratio = p["stiffness"], p["hardening_ratio"]
        return {
            "hardening": ratio * stiffness,
            "yielding": (1 - ratio) * stiffness,
            "yield_drift": p["yield_force"] / stiffness,
        }

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        plastic = wp.clamp(memory.plastic, drift - c.yield_drift, drift + c.yield_drift)
        return c.hardening * drift + c.yielding * (drift - plastic), plastic

    @wp.func
    def elastic_energy(drift: Any, memory: Any, c: Any):
        return 0.5 * (c.hardening * drift**2 + c.yielding * (drift - memory.plastic) ** 2)


class Wen(wd.laws.Law):
    """A Bouc-Wen storey with exponent 1 and beta = gamma = 0.5, as `wd.laws.BoucWen`."""

    yield_force: float = wd.laws.shared(wd.laws.YIELD_FORCE)
    hardening_ratio: float = wd.laws.shared(wd.laws.HARDENING_RATIO)

    memory = ("z",)

    @staticmethod
    def derived(p):
        ratio = p["hardening_ratio"]
        return {
            "hardening": ratio * p["stiffness"],
            "strength": (1 - ratio) * p["yield_force"],
            "inverse_yield_drift": p["stiffness"] / p["yield_force"],
        }

    @wp.func
    def force(drift: Any, memory: Any, c: Any):
        return c.hardening * drift + c.strength * memory.z

    @wp.func
    def rate(velocity: Any, memory: Any, c: Any):
        z = memory.z
        return c.inverse_yield_drift * (velocity - 0.5 * (velocity * wp.abs(z) + wp.abs(velocity) * z))

    @wp.func
    def elastic_energy(drift: Any, memory: Any, c: Any):
        return 0.5 * (c.hardening * drift**2 + c.strength / c.inverse_yield_drift * memory.z**2)


class RingSpring(wd.laws.Law):
    """A friction (ring) spring, which unloads at a fraction of the loading force."""

    preload: float = wd.laws.parameter("N", "force at which the rings begin to slide", low=0.0, low_open=True)
    loading_ratio: float = wd.laws.parameter("1", "loading over initial stiffness", low=0.0, high=1.0, high_open=True)
    unloading_ratio: float = wd.laws.parameter("1", "unloading over loading force", low=0.0, high=1.0, default=1 / 3)

    memory = ("force", "drift")

    @staticmethod
    def derived(p):
        return {"loading_stiffness": p["loading_ratio"] * p["stiffness"]}

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        side = wp.where(drift < 0, -1.0, 1.0)
        size = c.stiffness * wp.abs(drift)
        loading = c.preload + c.loading_stiffness * wp.abs(drift)
        upper = min(size, loading)
        lower = min(size, c.unloading_ratio * loading)
        force = side * wp.clamp(side * (memory.force + c.stiffness * (drift - memory.drift)), lower, upper)
        return force, force, drift


class Slider(wd.laws.Device):
    """A friction damper, as `wd.laws.FrictionDamper`."""

    slider_force: float = wd.laws.parameter("N", "force at which the slider slips", low=0.0)
    slider_stiffness: float = wd.laws.parameter("N m-1", "stiffness of the slider's brace", low=0.0, low_open=True)

    memory = ("slip",)

    @staticmethod
    def derived(p):
        return {"slip_drift": p["slider_force"] / p["slider_stiffness"]}

    @staticmethod
    def stiffest(p):
        return p["slider_stiffness"]

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        slip = wp.clamp(memory.slip, drift - c.slip_drift, drift + c.slip_drift)
        return c.slider_stiffness * (drift - slip), slip


class Cubic(wd.laws.Law):
    """An elastic storey that softens with the cube of its drift, F = k d - s d^3."""

    softening: float = wd.laws.parameter("N m-3", "softening of the storey", low=0.0)

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        return c.stiffness * drift - c.softening * drift**3

    @wp.func
    def elastic_energy(drift: Any, memory: Any, c: Any):
        return (0.5 * c.stiffness - 0.25 * c.softening * drift**2) * drift**2


for kind in (Kinematic, Wen, RingSpring, Cubic):  # other tests take the laws of warpdyn alone
    del LAWS[kind.name]
del DEVICES[Slider.name]
