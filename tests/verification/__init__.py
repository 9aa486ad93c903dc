"""Problems of the verification manual: one description for the tests and for the pages of the site."""

from __future__ import annotations

from .buildings import PROBLEMS as BUILDINGS
from .chains import PROBLEMS as CHAINS
from .contents import PROBLEMS as CONTENTS
from .devices import PROBLEMS as DEVICES
from .filters import PROBLEMS as FILTERS
from .frames import PROBLEMS as FRAMES
from .loops import PROBLEMS as LOOPS
from .lumped import PROBLEMS as LUMPED
from .lumped_devices import PROBLEMS as LUMPED_DEVICES
from .methods import PROBLEMS as METHODS
from .problem import Problem, Verdict, judge
from .random_motion import PROBLEMS as RANDOM
from .risk import PROBLEMS as RISK
from .sdof import PROBLEMS as SDOF
from .yielding import PROBLEMS as YIELDING

PROBLEMS: tuple[Problem, ...] = (
    *SDOF, *METHODS, *CHAINS, *BUILDINGS, *YIELDING, *DEVICES, *LOOPS, *RANDOM, *RISK, *LUMPED, *LUMPED_DEVICES,
    *CONTENTS, *FILTERS, *FRAMES,
)  # fmt: skip

__all__ = ["PROBLEMS", "Problem", "Verdict", "judge"]
