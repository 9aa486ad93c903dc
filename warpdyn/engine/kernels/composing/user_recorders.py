"""Recorders that users define in a script or notebook: defining a class registers it."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from types import FunctionType
from typing import Any, ClassVar

from warpdyn.engine.kernels.composing.source_text import bodies_of, source_of
from warpdyn.engine.kernels.slots import SLOTS
from warpdyn.foundations.core.output_variables import Variable
from warpdyn.foundations.core.sources import sources_read

USERS: dict[str, type[Recorder]] = {}  # recorders of users, by name
# Family of the structure -> recorder -> name -> variable.
TABLE: dict[str, dict[str, Mapping[str, Variable]]] = {"chain": {}, "lumped": {}, "dense": {}}


class Recorder:
    """Base class of recorders that users define; defining a subclass registers it.

    A class `StoreyForce` defines the recorder "storey_force" of a `Scene`. Its functions have no arguments and the
    names of slots; their statements are copied into the kernel. `docs/extending/recorder.md` explains the slots.

    Attributes:
        VARIABLES: The variables that the recorder writes: a dictionary from the family of the structure ("chain" for a
            ShearBuilding, "lumped" for a LumpedStructure, "dense" for a LinearSystem) to a dictionary from
            names to `Variable` objects.
        BORROWS: Variables of other parts of the kernel that the recorder reads: a dictionary from part to names.

    Raises:
        TypeError: If VARIABLES is missing or is not such a dictionary.
        ValueError: If another recorder has the same name or writes a variable of the same name.

    Example:
        >>> class StoreyForce(wd.kernels.Recorder):
        ...     VARIABLES = {"chain": {"peak_storey_force": wd.kernels.Variable(("storey",), "N", "peak storey force")}}
        ...
        ...     def declare():
        ...         peak_force = matrix()
        ...
        ...     def see_forces():
        ...         peak_force[i, j] = larger(peak_force[i, j], wp.abs(restoring))
        ...
        ...     def finish_storey():
        ...         output.peak_storey_force[g, o] = peak_force[i, j]
        >>> run = wd.simulate(wd.Scene(building, wd.Cloud(motions), recorders=(StoreyForce,)), device="cpu")
        >>> run["peak_storey_force"].dims
        ('sample', 'storey')
    """

    VARIABLES: ClassVar[Mapping[str, Mapping[str, Variable]]]
    BORROWS: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    part_name: ClassVar[str]

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls.part_name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()
        for name, each in vars(cls).items():
            if name in SLOTS and isinstance(each, FunctionType) and each.__code__.co_argcount:
                raise TypeError(
                    f"recorder {cls.__name__}: {name}() has arguments, but a slot's function has none: write "
                    f"def {name}(): its statements read the variables of the kernel"
                )
        if any(isinstance(each, FunctionType) for each in vars(cls).values()):  # otherwise pickle makes an empty class
            for function in bodies_of(cls).values():
                # Keep the source: the class may be pickled and sent to processes that do not have its file.
                function.__source__ = source_of(function)  # type: ignore[attr-defined]
            _register(cls)

    @classmethod
    def wanted(cls, plan: Any) -> bool:
        """Return whether the kernel of a plan contains the recorder."""
        return cls.part_name in plan.recorders

    @classmethod
    def values_held(cls, plan: Any) -> int:
        """Return the number of values that a thread keeps for the recorder: one per element of its variables."""
        variables = cls.VARIABLES.get(plan.family, {}).values()
        return sum(plan.dofs if variable.dims else 1 for variable in variables)


class RecorderName(str):
    """The name of a user's recorder; it is pickled with the class, so that other processes can register the class."""

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (USERS[str(self)],)

    def __repr__(self) -> str:
        """Return the name with a digest of the source; the fingerprint of a run contains this text."""
        functions = bodies_of(USERS[str(self)]).values()
        text = "".join(part for function in functions for part in sources_read(function, source_of))
        return f"{str(self)!r} (source {hashlib.sha256(text.encode()).hexdigest()[:16]})"


def recorder_name(recorder: Any) -> Any:
    """Return the name of a recorder class; other values, such as names, are returned unchanged."""
    if isinstance(recorder, type) and issubclass(recorder, Recorder):
        return RecorderName(recorder.part_name)
    return RecorderName(recorder) if isinstance(recorder, str) and recorder in USERS else recorder


def users_of(recorders: Iterable[str]) -> tuple[type[Recorder], ...]:
    """Return the classes of those recorders in a list of names that users have defined."""
    return tuple(USERS[name] for name in sorted({str(name) for name in recorders} & USERS.keys()))


def users_of_variables(names: Iterable[str]) -> tuple[type[Recorder], ...]:
    """Return the classes of users' recorders that write some of these variables."""
    wanted = set(names)
    writers = [name for name, each in USERS.items() if any(wanted & rows.keys() for rows in each.VARIABLES.values())]
    return users_of(writers)


def _restored(recorder: type[Recorder]) -> RecorderName:
    if USERS.get(recorder.part_name) is not recorder:
        _register(recorder)
    return RecorderName(recorder.part_name)


def _register(recorder: type[Recorder]) -> None:
    from warpdyn.engine.kernels.registry import recorders

    name, table = recorder.part_name, recorders()
    if not isinstance(getattr(recorder, "VARIABLES", None), Mapping) or not recorder.VARIABLES.keys() <= table.keys():
        raise TypeError(
            f"recorder {recorder.__name__}: VARIABLES must be a dictionary such as "
            '{"chain": {"peak_storey_force": wd.kernels.Variable(("storey",), "N", "peak storey force")}}'
        )
    taken = {variable: other for rows in table.values() for other, each in rows.items() for variable in each}
    if name not in USERS and any(name in rows for rows in table.values()):
        raise ValueError(f"recorder {recorder.__name__}: {name!r} is a recorder of warpdyn; rename the class")
    for family, variables in recorder.VARIABLES.items():
        for variable, row in variables.items():
            if not isinstance(row, Variable):
                raise TypeError(
                    f"recorder {recorder.__name__}: VARIABLES[{family!r}][{variable!r}] is not a Variable; give one, "
                    'such as wd.kernels.Variable(("storey",), "N", "peak storey force")'
                )
            if taken.get(variable, name) != name:
                raise ValueError(
                    f"recorder {recorder.__name__}: recorder {taken[variable]!r} writes {variable!r}, too; "
                    "choose another name for the variable"
                )
    for family, rows in table.items():
        rows.pop(name, None)
        if family in recorder.VARIABLES:
            rows[name] = recorder.VARIABLES[family]
    USERS[name] = recorder
