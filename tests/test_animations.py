"""Animations: displacements, roof and loop of each frame are those of the run; files are complete; what is refused."""

from __future__ import annotations

import matplotlib.animation
import numpy as np
import pytest
from matplotlib import colors
from PIL import Image
from plotted_curves import RUN

import warpdyn as wd
from warpdyn import plots
from warpdyn.interfaces.plots.style import COLLAPSE_COLOUR

pytestmark = pytest.mark.fast


def pushed():
    """Return forces of storeys along a path of drifts: a dataset without histories of displacements."""
    return wd.storey_hysteresis(wd.ShearBuilding.from_hazus("C1L", "high", 2), [0.01, -0.01])


def axes_of(movie):
    """Return the panels of an animation: buildings, roof displacements, loop."""
    buildings, roof, loop = movie._fig.axes
    return buildings, roof, loop


def draw(movie, frame):
    movie._func(frame)
    return axes_of(movie)


def test_a_frame_shows_the_displacements_of_its_time():
    """`RUN` has displacements of 0.05 sin(3 t) times 1, 1.6 and 1.9 m at its 3 floors, every 0.01 s for 2 s."""
    movie = plots.animate(RUN, 0, fps=20, magnification=4.0)
    assert movie.frames == 41
    buildings, roof, loop = draw(movie, 10)  # at 0.5 s
    floors = 0.05 * np.sin(1.5) * np.array([1.0, 1.6, 1.9])
    (line,) = [each for each in buildings.lines if each.get_color() == "#0072B2"]
    x = np.array(line.get_xdata())
    beams = np.array([x[-9:-7].mean(), x[-6:-4].mean(), x[-3:-1].mean()])
    np.testing.assert_allclose(beams, 4.0 * floors, rtol=1e-12)
    drawn = roof.lines[1]
    np.testing.assert_allclose(drawn.get_xdata(), np.arange(51) / 100, atol=1e-12)
    np.testing.assert_allclose(drawn.get_ydata()[-1], 1000 * floors[-1], rtol=1e-12)
    np.testing.assert_allclose(loop.lines[1].get_xdata()[-1], 1000 * floors[0], rtol=1e-12)
    force = RUN["storey_force"].isel(history=0, time=50, storey=0)
    np.testing.assert_allclose(loop.lines[1].get_ydata()[-1], force / 1e6, rtol=1e-12)
    assert loop.get_title() == "Force in storey 1 of sample 0"
    assert "magnified 4 times" in buildings.get_title()


def test_the_storey_and_the_part_of_the_history_are_chosen():
    movie = plots.animate(RUN, [0], storey=2, time=(0.5, 1.0), speed=2.0, fps=20)
    assert movie.frames == 6
    buildings, _, loop = draw(movie, 5)
    assert "1.0 s" in [text.get_text() for text in buildings.texts]
    assert loop.get_title() == "Force in storey 2 of sample 0"
    np.testing.assert_allclose(loop.lines[1].get_xdata()[-1], 1000 * 0.05 * np.sin(3.0) * 0.6, rtol=1e-9)


def test_a_collapsed_building_keeps_its_last_position_and_is_named():
    movie = plots.animate(RUN)  # the second history collapses at 1.195 s
    buildings, _, _ = draw(movie, 23)  # at 1.15 s
    assert not [text for text in buildings.texts if "collapsed" in text.get_text()]
    buildings, _, _ = draw(movie, 24)
    at_collapse = [np.array(line.get_xdata()) for line in buildings.lines[1:]]
    buildings, roof, _ = draw(movie, 40)
    (label,) = [text.get_text() for text in buildings.texts if "collapsed" in text.get_text()]
    assert label == f"sample {int(RUN['history_sample'][1])}\ncollapsed"
    np.testing.assert_array_equal(buildings.lines[2].get_xdata(), at_collapse[1])
    assert not np.array_equal(buildings.lines[1].get_xdata(), at_collapse[0])
    assert colors.same_color(buildings.lines[2].get_color(), COLLAPSE_COLOUR)
    assert np.max(roof.lines[4].get_xdata()) == pytest.approx(1.19)


@pytest.mark.parametrize("buildings", [1, 2, 6])
def test_no_texts_overlap(buildings):
    run = RUN.isel(history=[0, 1, 0, 1, 0, 1][:buildings])
    figure = plots.animate(run)._fig
    figure.draw_without_rendering()
    texts = [text for axes in figure.axes for text in (*axes.texts, axes.title, axes.xaxis.label, axes.yaxis.label)]
    axes = [each for each in figure.axes if each.axison]
    ticks = [tick for each in axes for axis in (each.xaxis, each.yaxis) for tick in axis._update_ticks()]  # in view
    texts += [tick.label1 for tick in ticks]
    boxes = [text.get_window_extent() for text in texts if text.get_text() and text.get_visible()]
    assert len(boxes) > 10
    width, height = figure.canvas.get_width_height()
    for i, box in enumerate(boxes):
        assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= width and box.y1 <= height  # noqa: PT018  inside the figure
        assert not [other for other in boxes[:i] if box.overlaps(other)]


@pytest.mark.parametrize("name", ["sway.gif", "sway.webp"])
def test_a_file_has_every_frame(name, tmp_path):
    path = tmp_path / name
    path.write_text("before")
    plots.animate(RUN, fps=5).save(path, dpi=40)
    with Image.open(path) as image:
        assert (image.format, image.n_frames) == (name.partition(".")[2].upper(), 11)
        assert image.size == (360, 192)
        image.seek(3)
        assert image.convert("RGB").getpixel((1, 1)) == (255, 255, 255)
    assert [each.name for each in tmp_path.iterdir()] == [name]


def test_a_notebook_shows_the_animation_and_an_unused_one_does_not_warn():
    assert "<script" in plots.animate(RUN, fps=2)._repr_html_()


def test_other_writers_are_those_of_matplotlib(tmp_path, monkeypatch):
    path = tmp_path / "own.gif"
    plots.animate(RUN, fps=2).save(path, matplotlib.animation.PillowWriter(fps=2), dpi=30)
    assert path.read_bytes()[:3] == b"GIF"
    monkeypatch.setattr(matplotlib.animation.FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(ImportError, match=r"MP4 needs the program ffmpeg.* or save sway\.gif or sway\.webp"):
        plots.animate(RUN, fps=2).save(tmp_path / "sway.mp4")
    with pytest.raises(ValueError, match=r"must end in '\.gif' or '\.webp' or '\.mp4'"):
        plots.animate(RUN, fps=2).save(tmp_path / "sway.png")


FAILED = RUN.assign(displacement=RUN["displacement"] * np.nan)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: plots.animate(RUN.drop_dims("history")), ValueError, r"histories=wd\.Histories\(\[0\]\)"),
        (lambda: plots.animate(pushed()), ValueError, r"histories=wd\.Histories\(\[0\]\)"),
        (lambda: plots.animate(3), TypeError, "takes a Dataset, got int"),
        (lambda: plots.animate(FAILED), ValueError, "failed, so its history is NaN"),
        (lambda: plots.animate(RUN, 2), ValueError, "history=2 does not exist; give 0 to 1"),
        (lambda: plots.animate(RUN, "first"), ValueError, "history must be a whole number"),
        (lambda: plots.animate(RUN, []), ValueError, "draws 1 to 6 histories, got 0"),
        (lambda: plots.animate(RUN, [0] * 7), ValueError, "draws 1 to 6 histories, got 7"),
        (lambda: plots.animate(RUN, storey=4), ValueError, "storey=4 does not exist; give 1 to 3"),
        (lambda: plots.animate(RUN, time=(1.0, 0.5)), ValueError, r"such as time=\(0, 2\), got \(1\.0, 0\.5\)"),
        (lambda: plots.animate(RUN, time=(3.0, 4.0)), ValueError, "begins at 3 s, but the histories end at 2 s"),
        (lambda: plots.animate(RUN, time=2.0), ValueError, "must be a start"),
        (lambda: plots.animate(RUN, fps=0), ValueError, "fps must be a finite number above 0"),
        (lambda: plots.animate(RUN, speed=-1), ValueError, "speed must be a finite number above 0"),
        (lambda: plots.animate(RUN, fps=1e5), ValueError, "would draw 200,001 frames, more than 5,000"),
        (lambda: plots.animate(RUN, magnification=0), ValueError, "magnification must be a finite number above 0"),
    ],
)
def test_wrong_arguments_are_refused(call, error, words):
    with pytest.raises(error, match=words):
        call()


def test_a_single_history_is_animated():
    assert plots.animate(RUN.isel(history=0)).frames == 41
