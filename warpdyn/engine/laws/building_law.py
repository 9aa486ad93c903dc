"""The storey laws, dampers and stops of a whole building; each storey may have a different law."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from typing import Any

import numpy as np

from warpdyn.engine.laws.law import StoreyElement, Values
from warpdyn.engine.laws.parameter import Parameter
from warpdyn.engine.laws.springs import OneOrOther, SideBySide, StoreyRules, Variant
from warpdyn.engine.laws.written.pickling import received, sent
from warpdyn.engine.methods.table import StoreyForces
from warpdyn.engine.tracing.arrays import is_traced

Element = type[StoreyElement]


def missing_at(name: str, storey: int, law: str) -> str:
    """Return a sentence for messages: a parameter is missing at a storey; the index `storey` is counted from 0."""
    return f"{name} is missing at storey {storey + 1}, whose law {law!r} needs it"


class BuildingLaw:
    """The laws of the storeys of a building, and the dampers and stops of the building (its devices).

    An object has the methods of a `Law`; they refer to the whole building.

    Args:
        laws: Law of each storey, or a single law for all storeys.
        devices: Dampers and stops of all storeys; the strength of each may be 0 in some storeys.
    """

    def __init__(self, laws: Sequence[Element], devices: Sequence[Element] = ()) -> None:
        self.of_storeys, self.devices = tuple(laws), tuple(devices)
        self.laws = tuple(dict.fromkeys(laws))
        several = len(self.laws) > 1
        self.storeys = [self.storeys_of(law) if several else np.arange(0) for law in self.laws]
        self.parameters = _widest([*self.laws, *self.devices])

    def __reduce__(self) -> tuple[Any, ...]:
        numbers = [self.laws.index(law) for law in self.of_storeys]
        return _received, (numbers, [sent(law) for law in self.laws], [sent(device) for device in self.devices])

    @property
    def name(self) -> str:
        """Names of the laws, dampers and stops as one text, such as "bilinear|bouc_wen+gap"."""
        return "+".join(["|".join(law.name for law in self.laws), *(device.name for device in self.devices)])

    @property
    def written(self) -> dict[str, str]:
        """Source texts of those laws, dampers and stops of the building that users have defined: {name: source}."""
        return {each.name: each.written for each in (*self.laws, *self.devices) if each.written}

    @property
    def has_only_linear_springs(self) -> bool:
        """Whether the springs of all laws, dampers and stops are linear; viscous dampers have no springs."""
        return all(law.is_linear for law in self.laws) and all(device.is_dashpot for device in self.devices)

    @property
    def is_linear_until_yield(self) -> bool:
        """Whether all storeys are linear until they yield; False if there are dampers or stops, or different laws."""
        return len(self.laws) == 1 and not self.devices and self.laws[0].is_linear_until_yield

    def forces(self, *, has_power_dampers: bool = False) -> StoreyForces:
        """Return the properties of the storey forces that decide which integration methods can be used.

        Args:
            has_power_dampers: Whether viscous dampers have an exponent other than 1. Linear dampers are omitted in the
                result, because every method supports them.
        """
        named = [each for each in (*self.laws, *self.devices) if not each.is_dashpot or has_power_dampers]
        return StoreyForces(
            tuple(each.name for each in named),
            self.has_only_linear_springs and not has_power_dampers,
            any(each.has_rate for each in named),
            any(each.relaxes for each in named),
        )

    def storeys_of(self, law: Element) -> np.ndarray:
        """Return the indices of the storeys that have a law, counted from 0, shape [storey of the law]."""
        return np.array([i for i, each in enumerate(self.of_storeys) if each is law])

    def _own(self, law: Element, storeys: np.ndarray, p: Values) -> Values:
        """Return the parameters {name: values} that a law reads, at the storeys with these indices."""
        if not storeys.size:
            return p
        names = {"mass", "stiffness", "height", *law.parameters}
        first, last = storeys[[0, -1]]
        is_range = last - first + 1 == storeys.size
        places = slice(first, last + 1) if is_range else storeys  # a slice copies no values
        return {name: p[name][..., places] for name in names if name in p}

    def _laws(self, p: Values) -> list[tuple[Element, np.ndarray, Values]]:
        """Return a tuple (law, indices of its storeys, their parameters) for each law of the building."""
        return [(law, own, self._own(law, own, p)) for law, own in zip(self.laws, self.storeys, strict=True)]

    def variants(self, p: Values) -> tuple[list[Variant], list[Variant]]:
        """Return the variants (sets of device functions) of the laws, and those of the devices except viscous dampers.

        Args:
            p: Parameters and stiffness of the storeys: {name: array of shape [structure, storey]}.
        """
        return [law.variant(own) for law, _, own in self._laws(p)], [
            d.variant(p) for d in self.devices if not d.is_dashpot
        ]

    def rules(self, p: Values) -> StoreyRules:
        """Return the combined device functions of the building; they are part of the plan of a kernel.

        Args:
            p: Parameters and stiffness of the storeys: {name: array of shape [structure, storey]}.
        """
        laws, devices = self.variants(p)
        if len(set(laws)) == 1:
            laws = laws[:1]
        *others, last = laws
        alternatives: Variant | OneOrOther = last
        for law in reversed(others):
            alternatives = OneOrOther(law, alternatives)
        found: StoreyRules = alternatives
        for device in devices:
            found = SideBySide(found, device)
        return found

    def coefficients(
        self, p: Values, variants: tuple[list[Variant], list[Variant]] | None = None
    ) -> tuple[np.ndarray, ...]:
        """Return the coefficients that the device functions read, each [structure, storey].

        Args:
            p: Parameters and stiffness of the storeys: {name: array of shape [structure, storey]}.
            variants: Device functions that read the coefficients, from `variants` of all structures; None: the variants
                of `p`. If `p` contains only some of the structures, faster device functions with other coefficients may
                fit them.
        """
        laws, devices = self.variants(p) if variants is None else variants
        if len(self.laws) == 1 and not devices:
            return self.laws[0].coefficients(p, laws[0].name)
        stiffness, count = p["stiffness"], len(set(laws))
        found: list[np.ndarray] = []
        for place, (variant, (law, storeys, own)) in enumerate(zip(laws, self._laws(p), strict=True)):
            # The first coefficients choose the law: 1 for any of the following laws, 0 for this one.
            kind = [] if count == 1 else [1.0] * place + [0.0] * (place < len(laws) - 1)
            for index, value in enumerate([*kind, *law.coefficients(own, variant.name)]):
                if index == len(found):
                    found.append(np.zeros_like(stiffness, dtype=float))
                found[index][..., storeys if storeys.size else slice(None)] = value
        for device, variant in zip((each for each in self.devices if not each.is_dashpot), devices, strict=True):
            found += [np.broadcast_to(value, np.shape(stiffness)) for value in device.coefficients(p, variant.name)]
        return tuple(found)

    def problem(self, p: Values) -> str | None:
        """Return a sentence about parameters that are outside their bounds or contradict each other, or None."""
        for law, storeys, own in self._laws(p):
            text = None
            for name, parameter in law.parameters.items() if storeys.size else ():  # bounds of this law alone
                if name not in own:
                    continue
                if is_traced(own[name]):
                    np.any(parameter.violations(own[name]))  # collects the condition
                    continue
                axes = ("structure", "storey")[-np.ndim(own[name]) :]
                text = text or parameter.first_violation(name, np.asarray(own[name]), axes)
            text = text or law.problem(own)
            if text and storeys.size:
                text = _counted_in_building(text, storeys)
            if text:
                return text
        return next(filter(None, (device.problem(p) for device in self.devices)), None)

    def caution(self, p: Values) -> str | None:
        """Return a warning about parameters of a law that make results unreliable, or None."""
        return next(filter(None, (law.caution(own) for law, _, own in self._laws(p))), None)

    def counts_reversals(self, p: Values) -> bool:
        """Return whether every reversal of a storey drift, however small, damages the storey."""
        return any(law.counts_reversals(own) for law, _, own in self._laws(p)) or any(
            device.counts_reversals(p) for device in self.devices
        )

    def is_sensitive(self, p: Values) -> bool:
        """Return whether a small change of the step or the motion may change the peak drifts by a large amount."""
        return any(law.is_sensitive(own) for law, _, own in self._laws(p)) or any(
            device.is_sensitive(p) for device in self.devices
        )

    def stiffest(self, p: Values) -> np.ndarray:
        """Return the largest tangent stiffness [N/m] of storeys with their dampers and stops, [structure, storey]."""
        stiffest = p["stiffness"].astype(float)
        for law, storeys, own in self._laws(p):
            stiffest[..., storeys if storeys.size else slice(None)] = law.stiffest(own)
        return sum((device.stiffest(p) for device in self.devices), stiffest)

    def steepest_damping(self, p: Values) -> np.ndarray:
        """Return the largest slope of a law's force along the velocity [N s/m], [structure, storey]."""
        found = np.zeros_like(p["stiffness"], dtype=float)
        for law, storeys, own in self._laws(p):
            found[..., storeys if storeys.size else slice(None)] = law.steepest_damping(own)
        return found

    def relaxation_rate(self, p: Values) -> np.ndarray:
        """Return the largest rate [1/s] at which forces relax at a constant drift, shape [structure, storey]."""
        of_laws = np.zeros_like(p["stiffness"], dtype=float)
        for law, storeys, own in self._laws(p):
            of_laws[..., storeys if storeys.size else slice(None)] = law.relaxation_rate(own)
        return reduce(np.maximum, (device.relaxation_rate(p) for device in self.devices), of_laws)


def _received(numbers: Sequence[int], laws: Sequence[Any], devices: Sequence[Any]) -> BuildingLaw:
    """Return the BuildingLaw that was pickled.

    Args:
        numbers: For each storey, the index of its law in `laws`.
        laws: The different laws, as the function `sent` pickles classes.
        devices: The dampers and stops, as the function `sent` pickles classes.
    """
    kinds: list[Element] = [received(each) for each in laws]
    return BuildingLaw([kinds[number] for number in numbers], [received(each) for each in devices])


def _counted_in_building(text: str, storeys: np.ndarray) -> str:
    """Return a sentence in which storey numbers count all storeys of the building, not only the storeys of one law.

    `storeys` contains the indices of the storeys of this law.
    """
    return re.sub(r"storey (\d+)", lambda found: f"storey {storeys[int(found[1]) - 1] + 1}", text)


def _widest(elements: Sequence[Element]) -> dict[str, Parameter]:
    """Return the parameters {name: parameter} of all laws, dampers and stops of a building.

    If several laws have a parameter of the same name, its bounds are the widest of their bounds.
    """
    found: dict[str, Parameter] = {}
    for element in elements:
        for name, parameter in element.parameters.items():
            known = found.setdefault(name, parameter)
            low, high = min(known.low, parameter.low), max(known.high, parameter.high)
            found[name] = replace(
                known,
                low=low,
                high=high,
                low_open=all(p.low_open for p in (known, parameter) if p.low == low),
                high_open=all(p.high_open for p in (known, parameter) if p.high == high),
            )
    return found
