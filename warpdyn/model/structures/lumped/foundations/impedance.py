"""Springs and dashpots of a footing at a frequency: of Pais and Kausel for a rectangle, of cone models for a disk."""

from __future__ import annotations

from warpdyn.model.structures.lumped.foundations.cones import disk_cone
from warpdyn.model.structures.lumped.foundations.footing import CircularFooting, RectangularFooting, Soil
from warpdyn.model.structures.lumped.foundations.pais_kausel import pais_kausel_impedance, pais_kausel_stiffness


class Impedance:
    """Stiffnesses and dashpots by mode: "x", "y", "z" [N/m, N s/m], "rx", "ry" [N m, N m s].

    Args:
        footing: The footing.
        soil: The soil.
        trapped_inertia: Moment of inertia of the soil that moves with a rocking disk [kg m2], or None.

    Raises:
        ValueError: If `trapped_inertia` is missing or has no effect.
    """

    def __init__(
        self, footing: RectangularFooting | CircularFooting, soil: Soil, trapped_inertia: float | None
    ) -> None:
        self.footing, self.soil = footing, soil
        if isinstance(footing, CircularFooting):
            sway, vertical = (disk_cone(motion, footing.radius, soil) for motion in ("horizontal", "vertical"))
            rocking = disk_cone("rocking", footing.radius, soil, trapped_inertia=trapped_inertia)
            self.cones = {"x": sway, "y": sway, "z": vertical, "rx": rocking, "ry": rocking}
        elif trapped_inertia is not None:
            raise ValueError("trapped_inertia has no effect on a RectangularFooting: remove trapped_inertia=")

    def at_rest(self) -> dict[str, float]:
        """Return the static stiffnesses."""
        if isinstance(self.footing, CircularFooting):
            return {mode: cone.stiffness for mode, cone in self.cones.items()}
        return {mode: float(each) for mode, each in pais_kausel_stiffness(self.footing, self.soil).items()}

    def at(self, omega: float) -> tuple[dict[str, float], dict[str, float]]:
        """Return stiffnesses and dashpots at a circular frequency [rad/s]; modes without a formula are missing."""
        if isinstance(self.footing, CircularFooting):
            found = {mode: complex(cone.dynamic_stiffness(omega)) for mode, cone in self.cones.items()}
            return {mode: each.real for mode, each in found.items()}, {
                mode: each.imag / omega for mode, each in found.items()
            }
        stiffness, dashpots = pais_kausel_impedance(self.footing, self.soil, omega)
        return {mode: float(each) for mode, each in stiffness.items()}, {
            mode: float(each) for mode, each in dashpots.items()
        }
