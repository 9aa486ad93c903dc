"""The common part of frames with hinges: their hinges, damping of floors only, and their description."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.bilinear.parameters import Bilinear, ElasticPerfectlyPlastic
from warpdyn.engine.laws.elastic.parameters import Elastic
from warpdyn.engine.laws.ibarra_medina_krawinkler.parameters import IbarraMedinaKrawinklerBilinear
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.model.structures.frames.frame import Frame
from warpdyn.model.structures.frames.hinges.plausibility import warn_of_implausible_hinges
from warpdyn.model.structures.frames.reduced_frame import ReducedFrame
from warpdyn.model.structures.lumped.spring import Spring

LARGEST_YIELD_ROTATION = 0.05  # rad, of the spring without its member; in messages
ELASTIC_ROTATION = 100.0  # rad; a hinge with a larger yield rotation is meant to stay elastic
STAYS_ELASTIC = "For one that never yields, give {'law': 'elastic'}"
NEVER_YIELDS = 1e12  # N m, of a hinge that stays elastic
# Words of storey laws in messages -> those of hinges. Names of parameters have underscores and are kept.
WORDS_OF_HINGES = {
    r"\(storey yield force\)": "(yield moment [N m])",
    r"\bstorey stiffness\b": "stiffness",
    r"\(drift ([^)]*)\)": r"(rotation \1 [rad])",
    r"\b[Dd]rift(s?)\b": r"rotation\1",
    r"\bforce(s?)\b": r"moment\1",
    r"(?<=\d) m\b": " rad",
}
WORDS_OF_BRACES = {
    r"\(storey yield force\)": "(axial yield force [N])",
    r"\bstorey stiffness\b": "stiffness",
    r"\bdrift(s?)\b": r"elongation\1",
}
LAWS_OF_HINGES = (Elastic, Bilinear, ElasticPerfectlyPlastic, IbarraMedinaKrawinklerBilinear)


class Hinge(Spring):
    """A rotational spring between the end of a member and its joint, or the yielding part of a brace.

    The deformation is the relative rotation [rad], or the elongation [m].

    Args:
        name: Name, such as "C1 start".
        dof: Degree of freedom of a floor.
        stiffness: Initial stiffness [N m/rad], of a brace [N/m].
        law: Law, as for a Spring; forces are moments [N m], drifts rotations [rad].
        is_axial: Whether it is a part of a brace.
        **parameters: Parameters of the law.
    """

    def __init__(
        self, name: str, dof: str, stiffness: float, law: Any, *, is_axial: bool = False, **parameters: float
    ) -> None:
        called = law if isinstance(law, str) else getattr(law, "name", law)
        if called not in [each.name for each in LAWS_OF_HINGES]:
            raise ValueError(_unknown_law(name, str(called)))
        try:
            super().__init__(name, {dof: 1.0}, law=law, stiffness=stiffness, rotational=not is_axial, **parameters)
        except ValueError as error:
            # Parameters that contradict each other are compared after they are set.
            words = _in_own_words(str(error), WORDS_OF_BRACES if is_axial else WORDS_OF_HINGES)
            raise ValueError(f"{words}{_of_strong(parameters, called)}{'' if is_axial else self._hint()}") from None
        self.direction = {dof: 0.0}  # its moment acts on massless rotations
        if self.law not in LAWS_OF_HINGES:
            raise ValueError(_unknown_law(name, self.law.name))

    def _hint(self) -> str:
        """Return a sentence on the hinge if its yield rotation is implausibly large; otherwise ""."""
        strength = getattr(self, "parameters", {}).get("yield_force", 0.0)
        rotation = strength / self.stiffness if strength else 0.0
        if rotation <= LARGEST_YIELD_ROTATION:
            return ""
        if rotation > ELASTIC_ROTATION:
            return f". {STAYS_ELASTIC}, or capping_force_ratio=1 with this yield_force"
        return (
            f". Its yield rotation, yield_force / stiffness, is {rotation:.3g} rad (usual: at most "
            f"{LARGEST_YIELD_ROTATION:g} rad): if yield_force is in N mm, give yield_force={strength / 1e3:g} [N m]; "
            f"if spring_start or spring_end is in kN m/rad, give {1e3 * self.stiffness:g} [N m/rad]"
        )


def _in_own_words(message: str, own_words: Mapping[str, str]) -> str:
    """Return a message of a storey law with the words and units of a hinge or a brace."""
    for words, own in own_words.items():
        message = re.sub(words, own, message)
    return message


def _of_strong(parameters: Mapping[str, float], law: str) -> str:
    """Return a sentence on hinges that never yield if the yield_force is infinite; otherwise ""."""
    strength = parameters.get("yield_force")
    if not isinstance(strength, int | float) or strength != np.inf:
        return ""
    large = f"yield_force={NEVER_YIELDS:g}"
    has_capping = law == IbarraMedinaKrawinklerBilinear.name
    return f". {STAYS_ELASTIC}, or {large}{' with capping_force_ratio=1' if has_capping else ''}"


def _unknown_law(hinge: str, law: str) -> str:
    known = sorted(each.name for each in LAWS_OF_HINGES)
    return (
        f"hinge {hinge!r}: {law!r} is not a law of hinges{did_you_mean(law, known)}; choose one of {', '.join(known)}"
    )


class HingedStructure(ReducedFrame):
    """A frame whose floors are integrated and whose massless rotations are solved in each stage.

    Args:
        frame: The frame.
        hinges: Checked laws of hinges by member and end, {(member, "start" or "end"): parameters with the law}.
        p_delta: Whether gravity loads soften the frame.
        outputs: ("drift",) or ().
        drift_capacity: Storey drift ratio at which samples collapse [1]; None: no collapse.
        damping: Inherent damping, as for a LumpedStructure.
        damping_ratio: Viscous damping ratio [1].
        damping_modes: The two modes of Rayleigh damping, counted from 1; None: 1 and 2.
        damping_matrix: Damping of the floors in addition to `damping` [N s/m], shape [floor, floor].
    """

    def __init__(
        self,
        frame: Frame,
        hinges: Mapping[tuple[str, str], Mapping[str, Any]],
        *,
        p_delta: bool,
        outputs: Sequence[str],
        drift_capacity: float | None,
        damping: str,
        damping_ratio: float | None,
        damping_modes: tuple[int, int] | None,
        damping_matrix: ArrayLike | None,
    ) -> None:
        who = type(self).__name__
        if not isinstance(outputs, tuple | list) or tuple(outputs) not in ((), ("drift",)):
            raise ValueError(
                f"outputs of a {who} are ('drift',) or (), got {outputs!r}: recorder 'spring' has storey "
                "shears and moments of hinges"
            )
        self.hinges = hinges
        super().__init__(
            frame,
            dofs=None,
            reduction="static",
            modes=0,
            p_delta=p_delta,
            vertical=False,
            outputs=outputs,
            members=None,
            drift_capacity=drift_capacity,
            damping=damping,
            damping_ratio=damping_ratio,
            damping_modes=damping_modes,
            damping_matrix=damping_matrix,
        )
        # Hinges whose yield_force is in a warning.
        self.implausible_hinges = warn_of_implausible_hinges(self)

    @property
    def hinge_names(self) -> tuple[str, ...]:
        """Names of the hinges with laws, such as "C1 start"."""
        return tuple(f"{member} {end}" for member, end in self.hinges)

    @property
    def gravity_moments(self) -> np.ndarray:
        """Absolute moments of the hinges, and forces of braces, under gravity [N m or N], shape [hinge]."""
        return np.zeros(len(self.hinges))

    @property
    def given_braces(self) -> dict[str, Hinge]:
        """Springs with the stiffness and the parameters of whole braces that yield, by name."""
        return {}

    @property
    def lacking(self) -> tuple[str, ...]:
        """Recorders that the structure cannot have: energies, because hinges have no rates."""
        return (*super().lacking, "energy")

    def linear_matrices(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return 0: the kernel finds the forces of members from the rotations."""
        return np.zeros((1, self.dofs, self.dofs))

    def dashpots(self, values: Mapping[str, np.ndarray], rayleigh: np.ndarray) -> np.ndarray:
        """Return 0: damping acts on the velocities of floors."""
        return np.zeros((len(values["mass"]), len(self.springs)))

    def scatter_problem(self, name: str, *, is_common_factor: bool) -> str | None:
        """Return why a parameter cannot be random."""
        if name == "stiffness":
            return "initial stiffnesses of hinges belong to the frame: scatter second_moment or yield_force instead"
        return super().scatter_problem(name, is_common_factor=is_common_factor)

    def description(self) -> dict[str, Any]:
        """Return the structure as a dictionary, for its JSON."""
        found = super().description()
        for name in ("dofs", "reduction", "modes", "vertical", "members"):
            del found[name]
        by_name = {spring.name: spring for spring in self.springs} | self.given_braces
        rows = []
        for (member, end), name in zip(self.hinges, self.hinge_names, strict=True):
            spring = by_name[name]
            rows.append({"member": member, "end": end, "law": spring.law.name, **spring.parameters})
        return found | {"type": type(self).__name__, "hinges": rows}

    def __repr__(self) -> str:
        return (
            f"{type(self).__name__}({self.dofs} storeys, {len(self.hinges)} hinges, T = "
            f"{self.fundamental_period:.4g} s, damping={self.damping!r})"
        )
