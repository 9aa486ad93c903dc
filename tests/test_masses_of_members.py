"""Masses of members in other units than kg/m give one warning; usual ones give none."""

import pytest
from test_mistakes_of_frames import arguments, changed

import warpdyn as wd

pytestmark = pytest.mark.fast


@pytest.mark.parametrize(
    ("mass", "area", "meant"),
    [
        (0.0926, 0.0118, "section 'c' is 7.84746 kg/m3 .*: with mass_per_length given in t/m, it would be 7.85e.03"),
        (
            0.908,
            0.0118,
            "section 'c' is 76.9492 .*: .*with mass_per_length given in kN/m of weight, it would be 7.85e.03",
        ),
        (92.6, 118.0, "section 'c' is 0.784746 .*: with area given in cm2, it would be 7.85e.03"),
        (92.6, 0.0118, None),  # kg/m
        (2000.0, 0.0118, None),  # with a floor
        (0.0, 0.0118, None),  # masses of floors
        (92.6, 11.8, None),  # a large area so that columns keep their lengths
        (92.6, 118.0, None),
    ],
)
def test_masses_of_members_in_other_units_are_warned_of(mass, area, meant):
    column = arguments()["sections"]["c"] | {"area": area, "mass_per_length": mass}
    if meant is not None and area > 100:
        column["second_moment"] = area * 0.11**2
    given = changed(sections={"c": column})
    if meant is None:
        wd.Frame(**given)
        return
    with pytest.warns(UserWarning, match=f"mass_per_length over area of the {meant}") as caught:
        wd.Frame(**given)
    assert len(caught) == 1
