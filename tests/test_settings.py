"""Settings of a run as objects: they are the single arguments of `simulate`, and are not given in both forms."""

import numpy as np
import pytest
import xarray as xr
from test_simulate import assert_same_bits, make_scene

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given("storey_height")


def test_objects_and_single_arguments_are_the_same_settings(tmp_path):
    single = {"step": 0.005, "dtype": "float64", "device": "cpu", "threads": 2, "keep_inputs": False}
    run = wd.simulate(make_scene(), structures=3, checked_share=0.5, **single)
    again = wd.simulate(
        make_scene(),
        structures=3,
        integration=wd.Integration(step=0.005, dtype="float64"),
        execution=wd.Execution(device="cpu", threads=2),
        outputs=wd.Outputs(keep_inputs=False, checked_share=0.5, path=tmp_path / "run.nc"),
    )
    assert (again["integration_step"] == 0.005).all()
    assert again["peak_storey_drift"].dtype == np.float64
    assert again.attrs["device"].startswith("cpu")
    assert "mass" not in again
    assert "estimated_relative_error" in again
    assert_same_bits(run, again.load())
    again.close()
    with xr.open_dataset(tmp_path / "run.nc") as written:
        assert_same_bits(run, written.load())


OBJECTS = {"integration": wd.Integration(), "execution": wd.Execution(), "outputs": wd.Outputs()}
SINGLE = [
    *(("integration", each) for each in ({"step": 0.01}, {"method": "rk4"}, {"resample": True})),
    *(("execution", each) for each in ({"device": "cpu"}, {"threads": 1}, {"memory": 10**9})),
    *(("outputs", each) for each in ({"path": "run.nc"}, {"keep_inputs": False}, {"checked_share": 0.1})),
    # Defaults: a caller who writes them expects them to count.
    *(("integration", each) for each in ({"resample": False}, {"on_unstable": "substep"})),
    *(("outputs", each) for each in ({"keep_inputs": True}, {"overwrite": False})),
]


@pytest.mark.fast
@pytest.mark.parametrize(("name", "single"), SINGLE)
def test_a_setting_in_both_forms_is_refused(name, single):
    [argument] = single
    expected = rf"^{argument}= cannot be combined with {name}=: write {name}=wd\.\w+\({argument}="
    with pytest.raises(ValueError, match=expected):
        wd.simulate(make_scene(), structures=1, **{name: OBJECTS[name]}, **single)


def test_none_beside_an_object_is_not_given():
    given = {"method": None, "step": None, "threads": None, "path": None}
    run = wd.simulate(make_scene(), structures=1, integration=wd.Integration(step=0.005, method="heun"), **given)
    assert (run["integration_step"] == 0.005).all()
    assert run.attrs["method"] == "heun"


@pytest.mark.fast
@pytest.mark.parametrize("name", OBJECTS)
def test_an_object_of_another_class_is_refused(name):
    for wrong in ({"step": 0.01}, "rk4", OBJECTS["outputs" if name != "outputs" else "execution"]):
        with pytest.raises(TypeError, match=rf"takes wd\.\w+, got \w+ as {name}"):
            wd.simulate(make_scene(), structures=1, **{name: wrong})


@pytest.mark.fast
@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: wd.Integration(step=0.0), ValueError, r"step \[s\]"),
        (lambda: wd.Integration(method="rk5"), ValueError, "'rk5'"),
        (lambda: wd.Integration(target_error=0.01, step=0.01), ValueError, "target_error chooses the step"),
        (lambda: wd.Integration(resample="no"), TypeError, "resample must be True or False"),
        (lambda: wd.Execution(threads=0), ValueError, "threads"),
        (lambda: wd.Execution(memory=0), ValueError, r"memory \[bytes\]"),
        (lambda: wd.Outputs(checked_share=1.5), ValueError, "checked_share must be a share"),
        (lambda: wd.Outputs(sample_error=1.0), ValueError, "sample_error must be a relative error"),
        (lambda: wd.Outputs(histories=3), TypeError, "histories must be Histories"),
        (lambda: wd.Outputs(statistics=[]), TypeError, "statistics must be"),
    ],
)
def test_values_out_of_range_are_refused_when_the_object_is_made(make, error, message):
    with pytest.raises(error, match=message):
        make()
