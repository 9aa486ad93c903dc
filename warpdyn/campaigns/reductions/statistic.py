"""Base class of statistics of a run's samples, with the dimensions of the result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.campaigns.reductions.cells import Cells, Coordinates, Variables
from warpdyn.campaigns.reductions.merging import Reducer
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.tally import FAILURES
from warpdyn.foundations.core.checks import checked_text, real_number, shortened, true_or_false, unmasked
from warpdyn.model.inventories.table import is_in_inventory_order, warn_of_inventory_order


@dataclass(frozen=True, eq=False, kw_only=True)
class Statistic:
    """A statistic of a run's samples, which `simulate` returns instead of the samples.

    Args:
        over: Name of a dimension of the result, or several names: "structure" (in a portfolio also "building"),
            "archetype", "motion", "stripe", "event" (of an EventSequence, or of `events`), "earthquake" (of
            MotionsAtSites), "structure_group" (groups for the intervals of fragility curves), or a name in `labels`.
            Empty: one value for the whole run.
        labels: Labels of the structures (texts or whole numbers, shape [structure]), by dimension names that you
            choose, such as {"cell": cells} for the cells of a map. A column of an inventory must be in the order of the
            portfolio: `stock.buildings(inventory)["occupancy"]`.
        added_storeys: Whether storeys of isolators or of a tuned mass damper, and the floors above them, count when the
            worst storey or floor is searched.
    """

    over: str | Sequence[str] = ()
    labels: Mapping[str, ArrayLike] = field(default_factory=dict)
    added_storeys: bool = False

    _inventory_columns: ClassVar[tuple[str, ...]] = ()  # names of arguments whose values are in an inventory's order

    def __post_init__(self) -> None:
        self._check_common()
        over = (self.over,) if isinstance(self.over, str) else self.over
        if not isinstance(over, list | tuple) or not all(isinstance(name, str) for name in over):
            raise TypeError(f"over must be a name or several names, as ('archetype', 'motion'), got {self.over!r}")
        object.__setattr__(self, "over", tuple(over))
        true_or_false("added_storeys", self.added_storeys)
        if not isinstance(self.labels, Mapping):
            raise TypeError(
                f"labels must map a name to the label of each structure, such as {{'cell': cells}}, got {self.labels!r}"
            )
        unused = [str(name) for name in self.labels if name not in over]
        if unused:
            raise ValueError(f"labels has {', '.join(map(repr, unused))}, which is not in over: add it to over=")
        given = {f"labels[{name!r}]": values for name, values in self.labels.items()}
        given |= {each.name: getattr(self, each.name) for each in fields(self)}
        # Keep the names of values in the order of an inventory, because the arrays made below do not show it. The
        # warning is issued when a run begins, because only then the archetypes are known.
        columns = tuple(name for name, values in given.items() if is_in_inventory_order(values))
        object.__setattr__(self, "_inventory_columns", columns)
        object.__setattr__(self, "labels", {name: _plain(values) for name, values in self.labels.items()})

    def _check_common(self) -> None:
        """Check the arguments that several kinds of statistics share, before a run begins."""
        given = {each.name: getattr(self, each.name) for each in fields(self)}
        kind = type(self).__name__
        if "demand" in given:
            checked_text(f"{kind}: demand", given["demand"])
        if "each_place" in given:
            true_or_false(f"{kind}: each_place", given["each_place"])
        for name in given.keys() & {"limits", "loss_ratios"}:
            if not isinstance(given[name], Mapping) or not given[name]:
                raise TypeError(
                    f"{kind}: {name} must map each damage state to a number, such as {{'slight': 0.005}}, "
                    f"got {shortened(given[name])}"
                )
            for state, value in given[name].items():
                what = f"{kind}: {name} of {state!r}"
                # Limits for several demands or archetypes, and ratios with a variation, are checked when a run begins.
                if isinstance(value, Mapping | list | tuple):
                    continue
                if name == "loss_ratios":
                    real_number(what, value, least=0)
                elif not (isinstance(value, float) and value == np.inf):  # infinity: only collapse counts
                    real_number(what, value, above=0)
        if given.get("events") is not None and not is_row(given["events"]):
            raise TypeError(
                f"{kind}: events must be the event of each motion, such as ['quake', 'quake', 'other'], "
                f"got {shortened(given['events'])}"
            )

    def cells(self, population: Population, events: Sequence[str] | Sequence[int] | None = None) -> Cells:
        """Return the cells of the statistic: one for each combination of indices along the dimensions `over`.

        Args:
            population: Structures, motions and levels of the run's samples.
            events: Event of each motion; only the worst motion of an event counts. None: each motion counts.
        """
        kinds = 1 if population.portfolio is None else len(population.portfolio.archetypes)
        for name in self._inventory_columns:
            warn_of_inventory_order(f"{type(self).__name__}: {name}", kinds)
        return Cells(population, tuple(self.over), self.labels, events)

    def reducer(self, population: Population) -> Reducer:
        """Return the reducer, which adds the samples of a run to the statistic.

        Raises:
            ValueError, TypeError, MemoryError: If the statistic cannot be computed for the run.
        """
        raise NotImplementedError


def is_row(values: object) -> bool:
    """Return whether a value is one-dimensional: a list, a tuple or an array (NumPy, pandas, xarray)."""
    return not isinstance(values, str | bytes | Mapping | set) and np.ndim(cast("Any", values)) == 1


def _plain(values: ArrayLike) -> np.ndarray:
    """Return labels as a NumPy array; texts of the type object, as in pandas tables, become NumPy texts."""
    array = unmasked("labels", values)
    is_text = array.dtype.kind == "O" and all(isinstance(label, str) for label in array.ravel())
    return array.astype(str) if is_text else array


def failures(cells: Cells, counts: np.ndarray) -> tuple[Variables, Coordinates]:
    """Return the variable with the numbers of failed samples, and its coordinate.

    Args:
        cells: Cells of the statistic.
        counts: Number of failed samples, shape [cell, failure status].
    """
    said = {"long_name": "samples that are not counted, because their integration failed", "units": "1"}
    table = counts.reshape(*cells.shape, len(FAILURES))
    coordinate = ("failure", np.array(FAILURES), {"long_name": "status of samples that failed"})
    return {f"failed_count{cells.suffix}": ((*cells.dims, "failure"), table, said)}, {"failure": coordinate}
