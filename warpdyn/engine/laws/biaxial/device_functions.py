"""Device functions of biaxial laws. The memory is z; that of circular yield contains the last deformation, too."""

import enum
from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import maximum, minimum
from warpdyn.engine.laws.biaxial.functions import BiaxialFunctions
from warpdyn.engine.laws.biaxial.parameters import Coefficient as C, SliderCoefficient as S
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.row_functions import device_functions


class M(Layout):
    """The memory; the last two values are those of circular yield."""

    ZX = enum.auto()
    ZY = enum.auto()
    X = enum.auto()  # deformation at the last accepted step
    Y = enum.auto()


LEAST_SQUARE = wp.constant(wp.float64(1e-24))  # of the length of z in a power


@wp.func
def biaxial_bouc_wen_force(deformation: Any, velocity: Any, memory: Any, c: Any):
    stiffness, strength = c[C.POST_YIELD_STIFFNESS], c[C.STRENGTH]
    return type(deformation)(
        stiffness * deformation[0] + strength * memory[M.ZX], stiffness * deformation[1] + strength * memory[M.ZY]
    )


@wp.func
def friction_slider_force(deformation: Any, velocity: Any, memory: Any, c: Any):
    speed = wp.sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1])
    friction = c[S.STRENGTH] * (c[S.FAST] - c[S.FAST_LESS_SLOW] * wp.exp(-c[S.RATE] * speed))
    stiffness = c[S.POST_YIELD_STIFFNESS]
    return type(deformation)(
        stiffness * deformation[0] + friction * memory[M.ZX], stiffness * deformation[1] + friction * memory[M.ZY]
    )


@wp.func
def biaxial_elastic_energy(deformation: Any, memory: Any, c: Any):
    half = type(memory[0])(0.5)
    stiffness, yielding = c[C.POST_YIELD_STIFFNESS], c[C.STRENGTH] / c[C.INVERSE_YIELD_DISPLACEMENT]
    return type(deformation)(
        half * (stiffness * deformation[0] * deformation[0] + yielding * memory[M.ZX] * memory[M.ZX]),
        half * (stiffness * deformation[1] * deformation[1] + yielding * memory[M.ZY] * memory[M.ZY]),
    )


@wp.func
def friction_slider_elastic_energy(deformation: Any, memory: Any, c: Any):
    half = type(memory[0])(0.5)
    slow = c[S.STRENGTH] * (c[S.FAST] - c[S.FAST_LESS_SLOW])
    stiffness, yielding = c[S.POST_YIELD_STIFFNESS], slow / c[S.INVERSE_YIELD_DISPLACEMENT]
    return type(deformation)(
        half * (stiffness * deformation[0] * deformation[0] + yielding * memory[M.ZX] * memory[M.ZX]),
        half * (stiffness * deformation[1] * deformation[1] + yielding * memory[M.ZY] * memory[M.ZY]),
    )


@wp.func
def bent_by(power: Any, c: Any):
    """Return the product of power, the factors beta or gamma, and the inverse yield displacement."""
    return c[C.INVERSE_YIELD_DISPLACEMENT] * (c[C.GAMMA] * power + c[C.BETA] * wp.abs(power))


@wp.func
def isotropic_2_decay(velocity: Any, memory: Any, c: Any):
    return bent_by(velocity[0] * memory[M.ZX] + velocity[1] * memory[M.ZY], c)


@wp.func
def isotropic_decay(velocity: Any, memory: Any, c: Any):
    square = memory[M.ZX] * memory[M.ZX] + memory[M.ZY] * memory[M.ZY]
    return isotropic_2_decay(velocity, memory, c) * wp.pow(maximum(square, type(square)(LEAST_SQUARE)), c[C.POWER])


@wp.func
def park_wen_ang_decay(velocity: Any, memory: Any, c: Any):
    return bent_by(velocity[0] * memory[M.ZX], c) + bent_by(velocity[1] * memory[M.ZY], c)


@wp.func
def friction_slider_decay(velocity: Any, memory: Any, c: Any):
    power = velocity[0] * memory[M.ZX] + velocity[1] * memory[M.ZY]
    return c[S.INVERSE_YIELD_DISPLACEMENT] * maximum(power, type(power)(0.0))


def _bouc_wen(
    row: str,
    decay: wp.Function,
    coefficients: int,
    power: int = -1,
    force: wp.Function = biaxial_bouc_wen_force,
    energy: wp.Function = biaxial_elastic_energy,
) -> BiaxialFunctions:
    """Return the functions of a law uy z' = u' - z uy decay(u', z, c).

    Args:
        row: Name of the variant.
        decay: `(velocity, memory, coefficients) -> rate [1/s]`.
        coefficients: Number of coefficients.
        power: Place of the coefficient (n - 2) / 2; negative: n = 2.
        force: The force.
        energy: The elastic energy.
    """
    HAS_POWER, POWER = power >= 0, max(power, 0)

    def rate(velocity: Any, memory: Any, c: Any):
        inverse, lost = c[C.INVERSE_YIELD_DISPLACEMENT], decay(velocity, memory, c)
        slope = type(memory)()
        slope[M.ZX] = inverse * velocity[0] - lost * memory[M.ZX]
        slope[M.ZY] = inverse * velocity[1] - lost * memory[M.ZY]
        return slope

    # The decay is a homogeneous function of z of degree n - 1, so deviations along z decay n times as fast as it does.
    def relaxation_rate(velocity: Any, memory: Any, c: Any):
        lost = decay(velocity, memory, c)
        two = type(lost)(2.0)
        if HAS_POWER:
            return (two + two * c[POWER]) * lost
        return two * lost

    functions = device_functions(row, rate, relaxation_rate)
    slope_of = functions["rate"]

    def memory_after(deformation: Any, increment: Any, memory: Any, c: Any):
        half = type(memory[0])(0.5)
        k1 = slope_of(increment, memory, c)
        k2 = slope_of(increment, memory + half * k1, c)
        k3 = slope_of(increment, memory + half * k2, c)
        k4 = slope_of(increment, memory + k3, c)
        return memory + (k1 + type(half)(2.0) * (k2 + k3) + k4) / type(half)(6.0)

    functions |= device_functions(row, memory_after)
    return BiaxialFunctions(force, elastic_energy=energy, coefficients=coefficients, memory=2, **functions)


@wp.func
def circular_yield_mapping(deformation: Any, memory: Any, c: Any):
    zero, one = type(memory[0])(0.0), type(memory[0])(1.0)
    after = memory
    ex = c[C.INVERSE_YIELD_DISPLACEMENT] * (deformation[0] - memory[M.X])
    ey = c[C.INVERSE_YIELD_DISPLACEMENT] * (deformation[1] - memory[M.Y])
    zx = memory[M.ZX] + ex
    zy = memory[M.ZY] + ey
    square = ex * ex + ey * ey
    if zx * zx + zy * zy > one and square > zero:
        # An elastic part up to the circle, then the exact solution of the plastic part along a straight path.
        along = memory[M.ZX] * ex + memory[M.ZY] * ey
        inside = minimum(memory[M.ZX] * memory[M.ZX] + memory[M.ZY] * memory[M.ZY] - one, zero)
        elastic = minimum((wp.sqrt(along * along - square * inside) - along) / square, one)
        size = wp.sqrt(square)
        nx = ex / size
        ny = ey / size
        zx = memory[M.ZX] + elastic * ex
        zy = memory[M.ZY] + elastic * ey
        radius = wp.sqrt(zx * zx + zy * zy)
        forward = (zx * nx + zy * ny) / radius
        sideways = (zy * nx - zx * ny) / radius
        turned = wp.tanh((one - elastic) * size)
        inverse = one / (one + forward * turned)
        forward = (forward + turned) * inverse
        sideways = sideways * wp.sqrt(maximum(one - turned * turned, zero)) * inverse
        zx = forward * nx - sideways * ny
        zy = forward * ny + sideways * nx
    after[M.ZX] = zx
    after[M.ZY] = zy
    after[M.X] = deformation[0]
    after[M.Y] = deformation[1]
    return after


@wp.func
def circular_yield_force(deformation: Any, velocity: Any, memory: Any, c: Any):
    return biaxial_bouc_wen_force(deformation, velocity, circular_yield_mapping(deformation, memory, c), c)


@wp.func
def circular_yield_memory_after(deformation: Any, increment: Any, memory: Any, c: Any):
    return circular_yield_mapping(deformation, memory, c)


SPRINGS = {
    "isotropic_bouc_wen_2": _bouc_wen("isotropic_bouc_wen_2", isotropic_2_decay, int(C.POWER)),
    "isotropic_bouc_wen": _bouc_wen("isotropic_bouc_wen", isotropic_decay, len(C), int(C.POWER)),
    "park_wen_ang": _bouc_wen("park_wen_ang", park_wen_ang_decay, int(C.POWER)),
    "friction_slider": _bouc_wen(
        "friction_slider",
        friction_slider_decay,
        len(S),
        force=friction_slider_force,
        energy=friction_slider_elastic_energy,
    ),
    "circular_yield": BiaxialFunctions(
        circular_yield_force,
        circular_yield_memory_after,
        biaxial_elastic_energy,
        int(C.BETA),
        len(M),
        mapping=circular_yield_mapping,
    ),
}
