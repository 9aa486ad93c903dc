"""The order of every method, measured from the kernels on a smooth linear problem against its exact solution."""

import numpy as np
import pytest
from method_sources import shown, thorough_unless
from seed_problem import AMPLITUDE, DAMPING, MASS, STIFFNESS
from validation import difference

import warpdyn as wd
from warpdyn.campaigns.integration.run import prepare
from warpdyn.engine.methods.kinds import MultistepMethod
from warpdyn.engine.methods.table import METHODS
from warpdyn.truth import harmonic_response

CHAIN = wd.ShearBuilding(MASS, 20e3, 3.0, damping="storey", damping_coefficient=30.0)
DENSE = wd.LinearSystem(MASS, DAMPING, STIFFNESS)
FLOORS = ("1", "2", "3")[: len(MASS)]
LUMPED = wd.LumpedStructure(
    dict(zip(FLOORS, MASS, strict=True)),
    [
        wd.Spring(
            f"storey {at + 1}",
            {name: 1.0} | ({FLOORS[at - 1]: -1.0} if at else {}),
            stiffness=20e3,
            damping_coefficient=30.0,
        )
        for at, name in enumerate(FLOORS)
    ],
)
FAMILIES = {"chain": CHAIN, "dense": DENSE, "lumped": LUMPED}


def fits(method, family):
    """Return whether a method of fixed or adaptive steps integrates a family of structures."""
    if family == "lumped":
        return isinstance(method, MultistepMethod)
    return (method.kind != "exact" and not isinstance(method, MultistepMethod)) or (family, method.name) == (
        "chain",
        "stoermer",
    )


DURATION = 4.0
# Steps short enough that the next term of the error hides less than 0.05 of an order, long enough for rounding.
STEPS = {1: (5e-5, 2.5e-5), 2: (2e-3, 1e-3), 3: (2e-3, 1e-3), 4: (4e-3, 2e-3), 5: (8e-3, 4e-3)}


def moved(scene, step, every=1, **settings):
    """Return times [s] and displacements [time, dof] of the only sample, from the kernel of histories alone."""
    run, _ = prepare(scene, structures=1, step=step, dtype="float64", device="cpu", **settings)
    assert run.schedule.step == pytest.approx(step)
    time, histories = run.integrate_histories((0,), every, step)
    assert np.isfinite(histories["displacement"]).all()
    return time, histories["displacement"][0]


@pytest.mark.parametrize(
    ("name", "structure"),
    [
        thorough_unless(structure is not CHAIN or name in shown(METHODS), name, structure, id=f"{name}-{family}")
        for name, method in METHODS.items()
        for family, structure in FAMILIES.items()
        if fits(method, family)
    ],
)
def test_measured_order(name, structure, measured):
    method, errors = METHODS[name], []
    scene = wd.Scene(structure, wd.HarmonicForce(AMPLITUDE, 10.0, DURATION), recorders=())
    # The adaptive method takes each step in one part at a tolerance that accepts all: its weights are what is measured.
    loose = {"tolerance": 0.1} if method.is_adaptive else {}
    for step in STEPS[method.order]:
        every = round(0.04 / step)
        time, found = moved(scene, step, every, method=name, **loose)
        exact = harmonic_response(MASS, DAMPING, STIFFNESS, AMPLITUDE, 10.0, 0.0, time)[0]
        errors.append(np.abs(found - exact).max())
    measured(
        "order of every method in its kernels: measured less stated",
        truth="exact solution of a linear frame under a harmonic force (`wd.truth`)",
        value=abs(np.log2(errors[0] / errors[1]) - method.order),
        bound=0.05,
    )
    assert errors[1] > 1e-13  # above rounding: the ratio is of the method's own errors


@pytest.mark.parametrize("structure", [CHAIN, DENSE], ids=["chain", "dense"])
def test_the_exact_method_has_no_error_at_any_step(structure, measured):
    scene = wd.Scene(structure, wd.HarmonicForce(AMPLITUDE, 10.0, DURATION), recorders=())
    for step in (0.2, 0.02):
        time, found = moved(scene, step, method="exact")
        exact = harmonic_response(MASS, DAMPING, STIFFNESS, AMPLITUDE, 10.0, 0.0, time)[0]
        measured(
            "kernels of the method `exact` at steps of 0.2 and 0.02 s",
            truth="exact solution of a linear frame under a harmonic force (`wd.truth`)",
            value=difference(found, exact),
            bound=1e-14,  # rounding of 0.014 m
            units="m",
        )
