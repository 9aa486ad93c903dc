"""The modal table and the figures of buildings: what is in them."""

from __future__ import annotations

import functools

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import warpdyn as wd
from warpdyn import plots

pytestmark = pytest.mark.fast

BUILDING = wd.ShearBuilding.from_hazus("C1M", "high", 5)


@functools.cache
def pushed_over() -> xr.Dataset:
    return wd.pushover(BUILDING, np.linspace(0, 0.3, 61)[1:])


def words(figure: Figure) -> list[str]:
    figure.draw_without_rendering()
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def test_modal_table_has_the_closed_forms() -> None:
    lines = wd.modal_table(BUILDING.modal()).splitlines()
    assert lines[0].split("  ")[0].strip() == "mode"
    # A uniform chain of five storeys: w = 2 sin((2 j - 1) pi / 22) sqrt(k / m).
    ratio = np.sin(np.pi / 22) / np.sin((2 * np.arange(1, 6) - 1) * np.pi / 22)
    for mode, line in enumerate(lines[1:]):
        number, period, frequency = (float(text) for text in line.split()[:3])
        assert number == mode + 1
        assert period == pytest.approx(0.75 * ratio[mode], rel=1e-4)
        assert frequency == pytest.approx(1 / period, rel=1e-4)
    assert lines[1].split()[5:] == ["87.95", "%", "87.95", "%"]  # of the mass: 0.87953
    assert lines[-1].endswith("100.00 %")
    assert len({len(line) for line in lines}) == 1
    assert len(wd.modal_table(BUILDING.modal().isel(mode=slice(2))).splitlines()) == 3


def test_drawing_names_springs_and_masses() -> None:
    text = words(plots.building(BUILDING))
    assert text.count("m = 1000 t") == 5
    assert "k = 866 MN/m\nFy = 8.96 MN" in text
    assert "first mode\n0.75 s, 88 % of the mass" in text


def test_isolators_and_dampers_are_no_storeys() -> None:
    added = BUILDING.with_tuned_mass_damper(0.05).on_isolators(
        law="lead_rubber_bearing", base_mass=1e6, displacement_capacity=0.5, stiffness=7.6e8, yield_force=5.8e6,
        post_yield_stiffness=7.6e7,
    )  # fmt: skip
    figure = plots.building(added)
    text = words(figure)
    assert any(each.startswith("isolators: k = ") for each in text)
    assert any(each.startswith("tuned mass damper: k = ") for each in text)
    # Five storeys of 3.66 m or so, and nothing that is as tall as the damper's 100 m.
    assert figure.axes[0].get_ylim()[1] < 1.2 * (BUILDING.parameters["height"].sum() + 3.0)


def test_large_displacements_are_written_in_full() -> None:
    pushed = pushed_over().assign(
        roof_displacement=pushed_over()["roof_displacement"] / pushed_over()["roof_displacement"].max()
    )
    labels = [each.get_text() for each in plots.pushover_curve(pushed).axes[1].get_legend().get_texts()]
    assert labels[-1] == "1000 mm"


@pytest.mark.parametrize("storeys", [1, 3, 11, 40])
def test_drawings_of_low_and_tall_buildings(storeys: int) -> None:
    text = words(plots.building(wd.ShearBuilding.from_hazus("W1", "low", storeys)))
    assert 1 <= sum(each.startswith("m = ") for each in text) <= 10


def test_pushover_and_hysteresis_are_drawn_from_one_dataset() -> None:
    curve, profile = plots.pushover_curve(pushed_over()).axes
    line = curve.lines[0]
    np.testing.assert_allclose(line.get_xdata()[1:], 1000 * pushed_over()["roof_displacement"])
    np.testing.assert_allclose(line.get_ydata()[1:], pushed_over()["base_shear"] / 1e6)
    # A storey's drift is drawn from its floor to its ceiling, at half its height too.
    outline = profile.lines[-1]
    assert outline.get_drawstyle() == "steps-post"
    np.testing.assert_allclose(outline.get_xdata()[1:], 1000 * pushed_over()["storey_drift"].values[-1])
    panels = plots.hysteresis(pushed_over()).axes
    assert len(panels) == 5
    np.testing.assert_allclose(panels[4].lines[0].get_ydata(), pushed_over()["storey_force"].values[:, 4] / 1e6)


def test_the_pushover_of_a_lumped_structure_shows_its_translational_springs() -> None:
    springs = [
        wd.Spring("sway", {"x": 1.0}, law="bilinear", stiffness=1e7, yield_force=1e5, hardening_ratio=0.1),
        wd.Spring("rocking", {"theta": 1.0}, stiffness=1e9),
        wd.Spring("top", {"x": -1.0, "theta": -5.0, "y": 1.0}, stiffness=1e7),
    ]
    structure = wd.LumpedStructure({"x": 1e4, "theta": 1e5, "y": 1e5}, springs, influence={"x": 1.0, "y": 1.0})
    pushed = wd.pushover(structure, np.linspace(0.0, 0.1, 21), pattern={"y": 1.0})
    curve, profile = plots.pushover_curve(pushed).axes
    assert curve.get_xlabel() == "Displacement of y [mm]"
    np.testing.assert_allclose(curve.lines[0].get_ydata()[1:], pushed["base_shear"].values / 1e6)
    assert [label.get_text() for label in profile.get_yticklabels()] == ["sway", "top"]
    drawn = profile.lines[-1].get_xdata()[1:]
    np.testing.assert_allclose(drawn, 1000 * pushed["spring_deformation"].sel(spring=["sway", "top"]).values[-1])
    turned = wd.pushover(structure, [0.001, 0.002], pattern={"y": 1.0}, control="theta")
    assert plots.pushover_curve(turned).axes[0].get_xlabel() == "Displacement of theta [rad]"


def test_storey_hysteresis_is_drawn() -> None:
    figure = plots.hysteresis(wd.storey_hysteresis(BUILDING, [0.01, -0.01, 0.02]))
    assert len(figure.axes) == 5
    upper = plots.hysteresis(wd.storey_hysteresis(BUILDING, [0.01, -0.01, 0.02]).isel(storey=[2, 4]))
    assert [axes.get_title() or axes.get_title(loc="left") for axes in upper.axes] == ["storey 3", "storey 5"]


def test_a_dataset_without_a_pushover_is_refused() -> None:
    with pytest.raises(
        ValueError,
        match=r"no roof_displacement, base_shear, storey_drift: draw the result of pushover\(building, ...\)",
    ):
        plots.pushover_curve(xr.Dataset())


@pytest.mark.parametrize("part", [{"step": 0}, {"storey": 0}])
def test_a_single_step_or_storey_is_refused_in_words(part: dict[str, int]) -> None:
    for plot in (plots.pushover_curve, plots.hysteresis):
        with pytest.raises(ValueError, match=r"select steps and storeys by isel\(step=\[...\], storey=\[...\]\)"):
            plot(pushed_over().isel(part))
    with pytest.raises(ValueError, match="the dataset has no steps"):
        plots.pushover_curve(pushed_over().isel(step=[]))
