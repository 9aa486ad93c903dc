"""The checks of the built site find links without targets, figures without text, and searches that miss their page."""

from __future__ import annotations

import importlib.util
import json
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from conftest import ROOT
from PIL import Image, ImageChops

import warpdyn as wd

pytestmark = pytest.mark.fast
FRONT = ROOT / "docs" / "_static" / "front"


def script(name: str) -> ModuleType:
    """Return a module of `docs/`."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look for their module
    spec.loader.exec_module(module)
    return module


def test_links_and_figures(tmp_path: Path) -> None:
    checks = script("check_links")
    (tmp_path / "a.html").write_text(
        '<p id="here"><a href="b.html">b</a><a href="#here">a</a><a href="#there">c</a></p>'
        '<img src="x.png" alt="_images/115de9f719494c7b4d824fd723bd45eaf2489b35636fb63a44ddcf17f2514799.png">'
        '<img src="y.png"><img src="z.png" alt="Fragility curves of a building">'
    )
    pages = checks.read_pages(tmp_path)
    for name in "xyz":
        (tmp_path / f"{name}.png").touch()
    assert checks.broken_links(tmp_path, pages) == ["a.html: #there", "a.html: b.html"]
    assert [line.split()[3] for line in checks.figures_without_text(tmp_path, pages)] == ["x.png", "y.png"]


def index(entries: dict[str, Any]) -> dict[str, Any]:
    """Return a search index of two pages in which the second has the word in its title."""
    return {
        "docnames": ["faq", "other"],
        "titles": ["Questions", "FAQ of others"],
        "alltitles": {"Questions": [[0, None]], "FAQ of others": [[1, None]]},
        "indexentries": entries,
        "objects": {},
        "objnames": {},
        "terms": {"faq": [0, 1]},
        "titleterms": {"faq": 1},
    }


def test_search_prefers_main_index_entries(tmp_path: Path) -> None:
    checks = script("check_search")
    for is_main, first in ((True, "faq"), (False, "other")):
        content = index({"faq": [[0, "index-0", is_main]]})
        (tmp_path / "searchindex.js").write_text(f"Search.setIndex({json.dumps(content)})")
        assert checks.search(checks.read_index(tmp_path), "FAQ")[0][1] == first
    assert "FAQ: other instead of faq" in checks.misplaced(tmp_path)


def test_pages_of_searches_and_thumbnails_exist() -> None:
    pages = list(script("check_search").FIRST.values())
    gallery = (ROOT / "docs" / "gallery.md").read_text()
    rows = re.findall(r"^(.+\?) \| ([\w/]+) \| (\d+)$", gallery, flags=re.MULTILINE)
    assert len(rows) >= 24
    assert len({(page, number) for _, page, number in rows}) == len(rows)
    for page in pages + [page for _, page, _ in rows]:
        folder, _, name = page.rpartition("/generated/warpdyn.")
        # Pages of the reference are generated from the public names.
        assert name in wd.__all__ if folder else (ROOT / "docs" / f"{page}.md").exists(), page


def test_front_page_shows_the_medians_of_the_first_study() -> None:
    # The table of the first study in Getting started is what the study prints.
    table = (ROOT / "docs" / "getting_started.md").read_text()
    numbers = json.loads((FRONT / "numbers.json").read_text())
    for state, row in numbers["states"].items():
        printed = re.search(rf"^{state} +0\.\d+ +([\d.]+) \[", table, flags=re.MULTILINE)
        assert printed is not None
        assert f"{row['median']:.3f}" == printed[1]
        assert all(low <= high for low, high in zip(row["lower"], row["upper"], strict=True))


def test_front_page_shows_the_measured_speeds() -> None:
    # 33 and 0.37 ms per history of one core; 528,088 histories in 48 s on two cores and 0.24 s on an H200.
    pictures = script("generate/front/pictures")
    of_r2d = (ROOT / "docs" / "coming_from" / "r2d.md").read_text()
    of_gpu = (ROOT / "docs" / "tutorials" / "gpu.md").read_text()
    opensees, ours = (1000 / pictures.ONE_CORE[name] for name in ("OpenSees", "warpdyn"))
    ratio = round(opensees / ours, -1)
    assert re.search(rf"OpenSees with its fastest settings[^|]*\| {opensees:.0f} \| {ratio:.0f} ", of_r2d)
    assert re.search(rf"warpdyn, 50,000 histories at once \| {ours:.2f} ", of_r2d)
    assert "| 528,088 | 0.24 s" in of_gpu
    assert pictures.FIRST_STUDY["NVIDIA H200"] == 528_088 / 0.24
    assert "**with half a million** 200 times (48 s)" in of_gpu
    assert [pictures.rate(value) for value in pictures.FIRST_STUDY.values()] == ["11,000", "2.2 million"]


def test_text_of_the_front_pictures_is_readable() -> None:
    # The three pictures stand beside each other in a column of at least 300 pixels each.
    pictures = script("generate/front/pictures")
    assert (pictures.TEXT - 0.5) / (72 * pictures.SIZE[0]) * 300 >= 11
    names = ("building", "curves", "speed")
    assert all((FRONT / f"{name}_{theme}.svg").exists() for name in names for theme in pictures.THEMES)


def test_animation_of_the_front_page_is_small_and_has_a_still_picture() -> None:
    page = (ROOT / "docs" / "index.md").read_text()
    (tag,) = re.findall(r"<img [^>]*>", page)
    source, moving, text = (re.search(rf'{name}="([^"]+)"', tag)[1] for name in ("src", "data-moving", "alt"))
    assert "sway side by side" in text
    assert (ROOT / "docs" / moving).stat().st_size < 1e6
    with Image.open(ROOT / "docs" / source) as still, Image.open(ROOT / "docs" / moving) as frames:
        assert (getattr(still, "n_frames", 1), frames.n_frames) == (1, 81)
        assert still.size == frames.size == (1080, 576)
        frames.seek(60)
        difference = ImageChops.difference(still.convert("RGB"), frames.convert("RGB"))
        assert max(high for _, high in difference.getextrema()) < 80  # a palette of fewer colours
    assert 8 / 72 * 1080 / 9 >= 11  # text of 8 points in a figure 9 inches wide, shown with this width


@pytest.mark.parametrize(
    ("written", "corrected"),
    [
        ("<tr><th></th><th>a</th></tr>", "<tr><td></td><th>a</th></tr>"),
        ('<th class="head"><p></p></th>', '<td class="head"></td>'),
        ("<thead><tr><th>a</th></tr></thead>", "<thead><tr><th>a</th></tr></thead>"),
        (
            "<th><p><math><mi>β</mi></math></p></th>",
            '<th><p><math aria-hidden="true"><mi>β</mi></math><span class="visually-hidden">β</span></p></th>',
        ),
        (
            "(\n<dl>\n<dd><em>mass</em>,</dd>\n<dd><em>law</em>,</dd>\n</dl>\n)",
            '(\n<ul class="sig-parameters"><li><em>mass</em>,</li>\n<li><em>law</em>,</li>\n</ul>\n)',
        ),
        (
            '<table class="dataframe"><thead><th>a</th></thead><th>1</th></table><th>b</th>',
            '<table class="dataframe"><thead><th scope="col">a</th></thead><th scope="row">1</th></table><th>b</th>',
        ),
        ("<dl><dt>mass</dt><dd>kg</dd></dl>", "<dl><dt>mass</dt><dd>kg</dd></dl>"),
        ("<dl>\n<dt>a</dt><dd><dl>\n<dd>b</dd></dl></dd></dl>", None),
    ],
)
def test_html_is_corrected_for_screen_readers(written: str, corrected: str | None) -> None:
    module = script("generate/accessible")
    if corrected is None:  # a list inside of a definition
        corrected = written.replace("<dl>\n<dd>b</dd></dl>", '<ul class="sig-parameters"><li>b</li></ul>')
    assert module.corrected(written) == corrected
