"""Problems of the verification manual: one description for the tests and for the pages of the site."""

from __future__ import annotations

from .chains import PROBLEMS as CHAINS
from .methods import PROBLEMS as METHODS
from .problem import Problem, Verdict, judge
from .sdof import PROBLEMS as SDOF

PROBLEMS: tuple[Problem, ...] = (*SDOF, *METHODS, *CHAINS)

__all__ = ["PROBLEMS", "Problem", "Verdict", "judge"]
