"""Selection of horizontal or vertical motions from a set in which some components may be unknown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from os import PathLike

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.orientations import is_vertical, orientation

# Value of the argument `components` -> whether a motion with a given component label is read.
COMPONENTS: dict[str, Callable[[str], bool]] = {
    "horizontal": lambda component: not is_vertical(component),
    "vertical": is_vertical,
    "all": lambda component: True,
}
_MOST_NAMED = 3  # motions that a warning names


def select_components(motions: Sequence[GroundMotion], components: str, path: str | PathLike) -> list[GroundMotion]:
    """Return the horizontal, the vertical or all motions of a file; raise a ValueError if there is no such motion."""
    labels, records = [motion.component for motion in motions], [motion.record for motion in motions]
    is_chosen = chosen_components(labels, components, [motion.name for motion in motions], records, str(path))
    chosen = [motion for motion, is_such in zip(motions, is_chosen, strict=True) if is_such]
    if not chosen:
        found = ", ".join(map(repr, labels))
        raise ValueError(f"{path}: no component of this file ({found}) is {components}: give components='all'")
    return chosen


def chosen_components(
    labels: Sequence[str], components: str, names: Sequence[str], records: Sequence[str], place: str
) -> list[bool]:
    """Return, for each motion of a set, whether it is a wanted component; warn of motions with an unknown component.

    A motion with an unknown component counts as horizontal only under two conditions: the set has no vertical motion,
    and the record of the motion does not have two other horizontal components.

    Args:
        labels: Component of each motion; "" if it is unknown.
        components: Wanted components: "horizontal", "vertical" or "all".
        names: Name of each motion, for a warning.
        records: Name of the record of each motion; "" if it is unknown.
        place: Folder or file of the set, for the warning.
    """
    kinds = [orientation(label).kind for label in labels]
    if components == "all":
        return [True] * len(labels)
    if components == "vertical":
        return [kind == "vertical" for kind in kinds]
    horizontal = Counter(record for record, kind in zip(records, kinds, strict=True) if kind == "horizontal" and record)
    unknown = [i for i, kind in enumerate(kinds) if kind == "unknown"]
    left_out = [i for i in unknown if "vertical" in kinds or horizontal[records[i]] >= 2]
    if kept := [i for i in unknown if i not in set(left_out)]:
        warn_caller(
            f"{place}: neither the header nor the name of {_some_names(names, kept)} contains the component, so a "
            "vertical record may be among them; they are read as horizontal. Rename the files, such as "
            "'quake-EW.AT2' and 'quake-UP.AT2'"
        )
    if left_out:
        warn_caller(
            f"{place}: neither the header nor the name of {_some_names(names, left_out)} contains the component, and "
            "the vertical component may be among them, so they are left out. Rename the files, such as "
            "'quake-EW.AT2', or give components='all'"
        )
    return [kind == "horizontal" or i in set(kept) for i, kind in enumerate(kinds)]


def _some_names(names: Sequence[str], chosen: Sequence[int]) -> str:
    """Return the names of the first chosen motions and the number of further ones, as text."""
    more = f" and {len(chosen) - _MOST_NAMED} more" if len(chosen) > _MOST_NAMED else ""
    return ", ".join(repr(names[i]) for i in chosen[:_MOST_NAMED]) + more
