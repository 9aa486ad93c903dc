"""The law of a whole building, whose storeys may differ in their laws and have devices beside them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from warpdyn.engine.laws import DEVICES
from warpdyn.engine.laws.law import Law, StoreyElement, Values
from warpdyn.engine.laws.parameter import Parameter


def name_of(laws: Sequence[str], devices: Sequence[str]) -> str:
    """Return what the law of a building is called: "bilinear|bouc_wen+gap" of two laws and a device."""
    return "+".join(["|".join(dict.fromkeys(laws)), *devices])


def storeys_of(laws: Sequence[str], law: str) -> np.ndarray:
    """Return the indices of the storeys of a law."""
    return np.array([i for i, name in enumerate(laws) if name == law])


def missing_at(name: str, storey: int, law: str) -> str:
    """Return a sentence on a parameter that a storey, counted from 0, has no value of."""
    return f"{name} is missing at storey {storey + 1}, whose law {law!r} needs it"


def law_of_storeys(
    table: Mapping[str, type[Law]], laws: Sequence[str], devices: Sequence[str]
) -> type[Law] | BuildingLaw:
    """Return the law of a building.

    Args:
        table: LAWS.
        laws: Law of each storey; a single one for all of them.
        devices: Devices that all storeys have, some perhaps of no strength.
    """
    distinct = tuple(dict.fromkeys(laws))
    if len(distinct) == 1 and not devices:
        return table[distinct[0]]
    return BuildingLaw(table, tuple(laws), distinct, tuple(devices))


class BuildingLaw:
    """The laws of a building's storeys, each of its own storeys, and the devices of all.

    It answers what a `Law` answers: its attributes and methods are those of one.
    """

    is_linear_until_yield = False  # a device, or one of the laws, may be at work from the start

    def __init__(
        self, table: Mapping[str, type[Law]], laws: tuple[str, ...], distinct: tuple[str, ...], devices: tuple[str, ...]
    ) -> None:
        self.laws = [table[name] for name in distinct]
        self.storeys = [storeys_of(laws, name) if len(distinct) > 1 else np.arange(0) for name in distinct]
        self.devices = [DEVICES[name] for name in devices]
        self.parameters = _widest([*self.laws, *self.devices])

    def _own(self, law: type[Law], storeys: np.ndarray, p: Values) -> Values:
        """Return what a law sees of the parameters: those of its storeys."""
        if not storeys.size:
            return p
        names = {"mass", "stiffness", "height", *law.parameters}
        return {name: p[name][..., storeys] for name in names if name in p}

    def spring(self, p: Values) -> str:
        rows = [law.spring(self._own(law, own, p)) for law, own in zip(self.laws, self.storeys, strict=True)]
        if len(set(rows)) == 1:
            rows = rows[:1]
        return "+".join(["|".join(rows), *filter(None, (device.spring(p) for device in self.devices))])

    def coefficients(self, p: Values, spring: str) -> tuple[np.ndarray, ...]:
        rows, shape = spring.split("+")[0].split("|"), np.shape(p["stiffness"])
        found: list[np.ndarray] = []
        for place, (law, storeys) in enumerate(zip(self.laws, self.storeys, strict=True)):
            # Which law it is, one coefficient after the other: 1 for any of those behind, 0 for the one at hand.
            kind = [] if len(rows) == 1 else [1.0] * place + [0.0] * (place < len(rows) - 1)
            values = law.coefficients(self._own(law, storeys, p), rows[place if len(rows) > 1 else 0])
            for index, value in enumerate([*kind, *values]):
                if index == len(found):
                    found.append(np.zeros(shape))
                found[index][..., storeys if storeys.size else slice(None)] = value
        for device in self.devices:
            found += [np.broadcast_to(value, shape) for value in device.coefficients(p, device.spring(p))]
        return tuple(found)

    def problem(self, p: Values) -> str | None:
        for law, storeys in zip(self.laws, self.storeys, strict=True):
            own = self._own(law, storeys, p)
            text = None
            for name, parameter in law.parameters.items() if storeys.size else ():  # the bounds are those of several
                if name not in own:
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
        pairs = zip(self.laws, self.storeys, strict=True)
        return next(filter(None, (law.caution(self._own(law, own, p)) for law, own in pairs)), None)

    def counts_reversals(self, p: Values) -> bool:
        return any(element.counts_reversals(own) for element, own in self._elements(p))

    def is_sensitive(self, p: Values) -> bool:
        return any(element.is_sensitive(own) for element, own in self._elements(p))

    def _elements(self, p: Values) -> list[tuple[type[StoreyElement], Values]]:
        """Return the laws and the devices, each with the parameters that it sees."""
        laws = [(law, self._own(law, storeys, p)) for law, storeys in zip(self.laws, self.storeys, strict=True)]
        return [*laws, *((device, p) for device in self.devices)]

    def stiffest(self, p: Values) -> np.ndarray:
        stiffest = np.array(p["stiffness"], dtype=float)
        for law, storeys in zip(self.laws, self.storeys, strict=True):
            stiffest[..., storeys if storeys.size else slice(None)] = law.stiffest(self._own(law, storeys, p))
        return stiffest + sum(device.stiffest(p) for device in self.devices)

    def relaxation_rate(self, p: Values) -> np.ndarray:
        rates = [device.relaxation_rate(p) for device in self.devices]
        return np.max(np.broadcast_arrays(np.zeros(np.shape(p["stiffness"])), *rates), axis=0)


def _counted_in_building(text: str, storeys: np.ndarray) -> str:
    """Return a sentence on storeys counted among themselves with their numbers in the building, by their indices."""
    return re.sub(r"storey (\d+)", lambda found: f"storey {storeys[int(found[1]) - 1] + 1}", text)


def _widest(elements: Sequence[type[StoreyElement]]) -> dict[str, Parameter]:
    """Return every parameter of any law or device, with the widest bounds where several have one of a name."""
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
