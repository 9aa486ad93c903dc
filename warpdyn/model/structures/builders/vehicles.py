"""Vehicles on a road (see `wd.SineRoad`): quarter car and half car."""

from __future__ import annotations

from warpdyn.engine.laws.law import Law
from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.structures.builders.built_structure import BuiltStructure
from warpdyn.model.structures.lumped.spring import Spring


@with_suggestions
class QuarterCar(BuiltStructure):
    """A quarter of a car: body and wheel, connected by a suspension, on a tyre without damping.

    Degrees of freedom: "body" and "wheel" [m], relative to the road below the wheel, upwards. Springs: "suspension" and
    "tyre"; the force of the tyre is its dynamic part, without the weight, and the tyre does not lift off. The motion is
    the vertical acceleration of the road, such as `wd.SineRoad(0.01, 5.0).motion(speed=20.0, duration=5.0,
    step=0.002)`; accelerations of results are total ones.

    Args:
        body_mass: Mass of the body on one wheel [kg].
        wheel_mass: Mass of the wheel and what moves with it [kg].
        suspension_stiffness: Stiffness of the suspension [N/m].
        suspension_dashpot: Coefficient of the shock absorber [N s/m].
        tyre_stiffness: Stiffness of the tyre [N/m].
        suspension_law: Law of the suspension spring, such as `wd.laws.Bilinear(...)`.

    Raises:
        ValueError: If a value is not finite or is out of its range.
        TypeError: If `suspension_law` is neither a name nor a law.

    Example:
        >>> car = wd.QuarterCar(300.0, 60.0, 16e3, 1e3, 190e3)
        >>> (1 / car.modal()["period"].values).round(3)
        array([1.116, 9.331])
        >>> road = wd.SineRoad(amplitude=0.01, wavelength=5.0).motion(speed=20.0, duration=5.0, step=0.002)
        >>> driven = wd.simulate(wd.Scene(car, road), device="cpu")
        >>> driven["peak_acceleration"].sel(dof="body").dims
        ('sample',)
    """

    def __init__(
        self,
        body_mass: float,
        wheel_mass: float,
        suspension_stiffness: float,
        suspension_dashpot: float,
        tyre_stiffness: float,
        *,
        suspension_law: str | Law | type[Law] = "elastic",
    ) -> None:
        dashpot = real_number("suspension_dashpot [N s/m]", suspension_dashpot, least=0)
        stiffness = real_number("suspension_stiffness [N/m]", suspension_stiffness, above=0)
        relative = {"body": 1.0, "wheel": -1.0}
        super().__init__(
            {
                "body": real_number("body_mass [kg]", body_mass, above=0),
                "wheel": real_number("wheel_mass [kg]", wheel_mass, above=0),
            },
            [
                Spring("suspension", relative, law=suspension_law, stiffness=stiffness, damping_coefficient=dashpot),
                Spring("tyre", {"wheel": 1.0}, stiffness=real_number("tyre_stiffness [N/m]", tyre_stiffness, above=0)),
            ],
            is_machine=True,
        )

    def __repr__(self) -> str:
        body, wheel = self.parameters["mass"]
        return f"QuarterCar(body {body:g} kg, wheel {wheel:g} kg)"


@with_suggestions
class HalfCar(BuiltStructure):
    """Half a car, front and rear axle: bounce and pitch of the body, and the two wheels, on tyres without damping.

    Degrees of freedom, relative to the road and upwards: "bounce" of the centre of mass [m], "pitch" [rad] (positive
    with the front upwards), "front wheel" and "rear wheel" [m]. The two components of the base motion are the
    accelerations of the road below the front and the rear wheel; `motion_of_axles` of a road makes them. Displacements
    of the body are relative to the straight line through the two points of contact. This is exact, because the car is
    statically determinate on its two wheels and tyres have no damping.
    Springs: "front suspension", "rear suspension", "front tyre" and "rear tyre", which do not lift off.

    Args:
        body_mass: Mass of the body [kg].
        pitch_inertia: Moment of inertia of the body about its centre of mass [kg m2].
        front_distance: Distance from the centre of mass to the front axle [m].
        rear_distance: Distance from the centre of mass to the rear axle [m].
        wheel_mass: Mass of front and rear wheel [kg], shape [2].
        suspension_stiffness: Stiffness of front and rear suspension [N/m], shape [2].
        suspension_dashpot: Coefficient of front and rear shock absorber [N s/m], shape [2].
        tyre_stiffness: Stiffness of front and rear tyre [N/m], shape [2].

    Raises:
        ValueError: If a value is not finite or is out of its range, or there is not one value for each axle.
        TypeError: If a value is not a number.

    Example:
        >>> car = wd.HalfCar(1200.0, 2100.0, 0.9, 1.2, (60.0, 60.0), (28e3, 21e3), (2500.0, 2000.0), (2e5, 2e5))
        >>> bump = wd.RoadBump(height=0.05, length=2.0)
        >>> both = bump.motion_of_axles(car.wheelbase, speed=10.0, duration=3.0, step=0.002)
        >>> driven = wd.simulate(wd.Scene(car, both), device="cpu")
        >>> driven["peak_displacement"].sel(dof="pitch").item() > 0.01
        True
    """

    names_of_builder = ("wheelbase",)

    def __init__(
        self,
        body_mass: float,
        pitch_inertia: float,
        front_distance: float,
        rear_distance: float,
        wheel_mass: tuple[float, float],
        suspension_stiffness: tuple[float, float],
        suspension_dashpot: tuple[float, float],
        tyre_stiffness: tuple[float, float],
    ) -> None:
        front = real_number("front_distance [m]", front_distance, above=0)
        rear = real_number("rear_distance [m]", rear_distance, above=0)
        wheels = _pair("wheel_mass", wheel_mass, "kg")
        stiffness = _pair("suspension_stiffness", suspension_stiffness, "N/m")
        dashpots = _pair("suspension_dashpot", suspension_dashpot, "N s/m", least=0)
        tyres = _pair("tyre_stiffness", tyre_stiffness, "N/m")
        self.wheelbase = front + rear
        arms = {"front": front, "rear": -rear}
        springs = []
        for place, (axle, arm) in enumerate(arms.items()):
            wheel = f"{axle} wheel"
            springs += [
                Spring(
                    f"{axle} suspension",
                    {"bounce": 1.0, "pitch": arm, wheel: -1.0},
                    stiffness=stiffness[place],
                    damping_coefficient=dashpots[place],
                ),
                Spring(f"{axle} tyre", {wheel: 1.0}, stiffness=tyres[place]),
            ]
        super().__init__(
            {
                "bounce": real_number("body_mass [kg]", body_mass, above=0),
                "pitch": real_number("pitch_inertia [kg m2]", pitch_inertia, above=0),
                "front wheel": wheels[0],
                "rear wheel": wheels[1],
            },
            springs,
            influence=[
                {"bounce": rear / self.wheelbase, "pitch": 1 / self.wheelbase, "front wheel": 1.0},
                {"bounce": front / self.wheelbase, "pitch": -1 / self.wheelbase, "rear wheel": 1.0},
            ],
            is_machine=True,
        )

    def __repr__(self) -> str:
        return f"HalfCar(body {self.parameters['mass'][0]:g} kg, wheelbase {self.wheelbase:g} m)"


def _pair(what: str, given: object, units: str, *, least: float | None = None) -> tuple[float, float]:
    """Return the values of front and rear axle."""
    if not isinstance(given, list | tuple) or len(given) != 2:
        raise ValueError(f"{what} must be two values in {units}, for the front and the rear axle, got {given!r}")
    front, rear = (
        real_number(f"{what} of the {axle} axle [{units}]", value, least=least, above=0.0 if least is None else None)
        for axle, value in zip(("front", "rear"), given, strict=True)
    )
    return front, rear
