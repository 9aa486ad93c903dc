"""What is wrong with portfolios and with their runs is told before a kernel runs, by the archetype's name."""

import pytest
from test_portfolio import CITY, SCATTER, STRIPES, TABLE, chain, simulate, smooth
from test_simulate import MOTIONS

import warpdyn as wd
from warpdyn.campaigns.portfolio.groups import parameters_of
from warpdyn.engine.kernels import queues

pytestmark = [
    pytest.mark.fast,
    pytest.mark.meant_as_given("first_period", "random_value", "yield_base_shear_coefficient"),
]


BAD = {
    "no archetypes": (lambda: wd.Portfolio({}), "at least one Archetype"),
    "no mapping": (lambda: wd.Portfolio([chain(1)]), "archetypes must map names"),
    "no archetype": (
        lambda: wd.Portfolio({"a": chain(1)}),
        "archetype 'a': it must be an Archetype, such as Archetype.building., got ShearBuil",
    ),
    "no name": (lambda: wd.Portfolio({3: wd.Archetype(chain(1))}), "name of an archetype must be text, got 3"),
    "count": (lambda: wd.Portfolio({"a": wd.Archetype(chain(1), 0)}), "^count must be a whole number"),
    "building": (
        lambda: wd.Portfolio({"a": wd.Archetype(wd.LinearSystem([1.0], [[0.0]], [[1.0]]))}),
        "^building must be a ShearBuilding or a LumpedStructure with storeys, got LinearSystem",
    ),
    "listed": (
        lambda: wd.Portfolio({"ok": wd.Archetype(chain(1)), "a": wd.Archetype(chain(3), 5, TABLE)}),
        "^scatter\\['stiffness'\\] lists values of 4 buildings, but the archetype has 5",
    ),
    "unknown": (
        lambda: wd.Portfolio({"a": wd.Archetype(chain(1), scatter={"masss": 1.0})}),
        "^scatter names unknown parameter 'masss'",
    ),
    "correlation": (
        lambda: wd.Portfolio({"a": wd.Archetype(chain(1), 2, SCATTER, {("mass", "height"): 0.1})}),
        "^correlation names",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_errors_name_the_archetype(case):
    make, message = BAD[case]
    with pytest.raises((ValueError, TypeError), match=message):
        make()


def refuse(*arguments, **named):
    pytest.fail("a kernel was reached")


WILD = {"mass": wd.RandomValue(wd.Normal(0.0, 1.0))}
BAD_DRAW = wd.Portfolio({"bad": wd.Archetype(chain(1), 9, WILD)})
RUNS = {
    "scatter": ({"scatter": SCATTER}, r"scatter of .*mass.* has no scatter.*Archetype\(building, count, scatter\)"),
    "correlation": ({"correlation": {("mass", "stiffness"): 0.5}}, "correlation of .* has no correlation"),
    "excitation": ({"excitation": wd.FreeVibration(1.0)}, "OneMotionPerStructure or MotionsAtSites, got FreeVibration"),
    "structures": ({"structures": 3}, "structures= does not apply to a portfolio: remove structures, and give"),
    "histories": ({"histories": wd.Histories([0])}, "histories of a portfolio are not kept"),
    "individual": ({"excitation": wd.OneMotionPerStructure(MOTIONS, [0, 1])}, "motion has 2 values, but the run has 25 "
    "struct"),
    "method": ({"method": "exact"}, "archetype 'low': method 'exact' does not fit storeys of law 'bilinear'"),
    "unknown method": ({"method": "euler"}, "unknown method 'euler'"),
    "recorder": ({"recorders": ("drifts",)}, "unknown recorder"),
    "sampling": ({"sampling": "sobol"}, "sampling of a portfolio must be 'monte_carlo', got 'sobol'"),
    "seed": ({"seed": -1}, "seed must be a whole number of at least 0"),
    "drawn": (
        {"portfolio": wd.Portfolio({"ok": wd.Archetype(chain(1)), "bad": wd.Archetype(chain(1), 9, WILD)})},
        "archetype 'bad': the drawn mass is",
    ),
    "listed": (
        {"portfolio": wd.Portfolio({"bad": wd.Archetype(chain(1), scatter={"mass": wd.GivenValues([1.0, -1.0])})})},
        "archetype 'bad': the given mass is -1 at structure 1.*correct its GivenValues",
    ),
    "between parameters": (
        {"portfolio": wd.Portfolio({"bad": wd.Archetype(smooth(1), scatter={"gamma": wd.GivenValues([0.1, 0.9])})})},
        "archetype 'bad': .*gamma is 0.9 and beta is 0.5",
    ),
    # Settings are judged before anything is drawn, and are no archetype's fault.
    "step": ({"step": 0.007}, "^step 0.007 s does not divide"),
    "typo": ({"stpe": 0.01, "portfolio": BAD_DRAW}, "no argument 'stpe'.*did you mean 'step'"),
    "dtype": ({"dtype": "float16", "portfolio": BAD_DRAW}, "^unknown dtype 'float16'"),
    "checked share": ({"checked_share": 2, "portfolio": BAD_DRAW}, "^checked_share must be a share"),
    "target error": ({"target_error": -1.0, "portfolio": BAD_DRAW}, "^target_error must be"),
    "target error and step": ({"target_error": 0.01, "step": 0.01}, "^target_error chooses the step"),
    "on_unstable": ({"on_unstable": "stop", "portfolio": BAD_DRAW}, "^unknown on_unstable 'stop'"),
    "threads": ({"threads": 0, "portfolio": BAD_DRAW}, "^threads must be"),
    "tolerance": ({"tolerance": 1e-6, "portfolio": BAD_DRAW}, "^method 'rk4' does not use a tolerance"),
}  # fmt: skip


@pytest.mark.parametrize("case", RUNS)
def test_bad_runs_are_refused_before_a_kernel(case, monkeypatch):
    changes, message = RUNS[case]
    monkeypatch.setattr(queues.CpuQueue, "launch", refuse)
    arguments = {"portfolio": CITY, "excitation": STRIPES, "device": "cpu"} | changes
    with pytest.raises((ValueError, TypeError), match=message):
        simulate(**arguments)


def test_listed_and_drawn_values_must_fit_each_other():
    tall = wd.ShearBuilding(1e5, 1e7, 3.0, law="bilinear", yield_force=1e5, hardening_ratio=0.1, gravity_load=1e7)

    def drawn(**scatter):
        return parameters_of(wd.Portfolio({"tall": wd.Archetype(tall, scatter=scatter)}), "tall", seed=0)

    soft, stiff = wd.RandomValue(wd.Uniform(0.5e7, 0.9e7)), wd.RandomValue(wd.Uniform(2e7, 3e7))
    with pytest.raises(ValueError, match=r"tall.*gravity_load adds up to 2\.9e\+07 N.*buckles"):
        drawn(gravity_load=wd.GivenValues([2.9e7]), stiffness=soft)
    # More than the nominal storey would bear, and less than this one does.
    assert drawn(gravity_load=wd.GivenValues([4e7]), stiffness=stiff)["stiffness"].min() >= 2e7
