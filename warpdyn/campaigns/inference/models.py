"""The model of a calibration: a storey whose parameters have priors, or a scene with random scatter."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Real
from typing import Any

import numpy as np

from warpdyn.engine.laws import LAWS
from warpdyn.engine.laws.law import Law
from warpdyn.engine.laws.lookup import law_name
from warpdyn.engine.laws.parameter import names_of
from warpdyn.foundations.core.checks import real_number, shortened
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.model.scene.distributions.numerical import as_distribution
from warpdyn.model.scene.scatter import RandomValue, Scatter
from warpdyn.model.scene.scene import Scene
from warpdyn.model.structures.shear_building import ShearBuilding

STIFFNESS = "stiffness"
MASS, HEIGHT = 1.0, 1.0  # of the storey of a law [kg, m]; they have no effect on its loop


def calibrated_scene(model: object, priors: Mapping[str, Any] | None) -> Scene:
    """Return the scene of a calibration to response histories.

    Raises:
        TypeError: If the model is not a Scene.
        ValueError: If priors are given in addition to those of the scene.
    """
    if not isinstance(model, Scene):
        raise TypeError(
            "calibrate: a MeasuredResponse needs a Scene, which contains the structure, the motion and the priors, got "
            f"{shortened(model)}: give wd.Scene(building, motion, scatter={{'stiffness': wd.RandomFactor(...)}})"
        )
    if priors is not None:
        raise ValueError("calibrate: the prior of a Scene is its random scatter: remove priors=")
    return model


def calibrated_storey(model: object, priors: Mapping[str, Any] | None) -> tuple[ShearBuilding, Scatter]:
    """Return the storey of a calibration to a loop, with nominal values, and the scatter that is the prior.

    Raises:
        TypeError: If the model is neither a law nor a ShearBuilding, or the priors are not a mapping.
        ValueError: If a parameter is unknown or missing.
    """
    if isinstance(model, Scene):
        raise TypeError(
            "calibrate: a MeasuredLoop needs a storey law, such as 'bouc_wen', or a ShearBuilding of one storey, got a "
            "Scene: give the law, or a wd.MeasuredResponse"
        )
    if not isinstance(priors, Mapping) or not priors:
        raise TypeError(
            "calibrate: priors must map parameters to distributions, such as priors={'stiffness': wd.Lognormal(3e7, "
            f"0.5), 'yield_force': wd.Lognormal(2e5, 0.5)}}, got {shortened(priors)}"
        )
    fixed = {name: each for name, each in priors.items() if isinstance(each, Real) and not isinstance(each, bool)}
    random = {name: as_distribution(each) for name, each in priors.items() if name not in fixed}
    if isinstance(model, ShearBuilding):
        if fixed:
            raise ValueError(
                f"calibrate: {', '.join(fixed)} has a number as its prior, but the ShearBuilding has the fixed "
                "values: give the number to the building"
            )
        return model, {name: RandomValue(each) for name, each in random.items()}
    law = LAWS[law_name(model)]
    known = (STIFFNESS, *law.parameters)
    for name in priors:
        if name not in known:
            hint = did_you_mean(name, names_of(law.parameters) | {STIFFNESS: STIFFNESS})
            raise ValueError(
                f"calibrate: the law {law.name!r} has no parameter {name!r}{hint}; its parameters are "
                f"{', '.join(known)}"
            )
    values: dict[str, Any] = {**model.values()} if isinstance(model, Law) else {}
    values |= {name: real_number(f"priors[{name!r}]", each) for name, each in fixed.items()}
    values |= {name: float(np.asarray(each.from_standard_normal(np.zeros(1)))[0]) for name, each in random.items()}
    needed = [STIFFNESS, *(n for n, each in law.parameters.items() if each.default is None and not each.optional)]
    if missing := [name for name in needed if name not in values]:
        raise ValueError(
            f"calibrate: {' and '.join(missing)} of the law {law.name!r} {'is' if len(missing) == 1 else 'are'} "
            "missing: give a prior or a number, such as "
            f"priors={{{missing[0]!r}: wd.Lognormal(median, dispersion), ...}}"
        )
    storey = ShearBuilding(MASS, values.pop(STIFFNESS), HEIGHT, law=law, **values)
    return storey, {name: RandomValue(each) for name, each in random.items()}
