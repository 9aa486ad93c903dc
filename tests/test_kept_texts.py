"""Composed texts of kernels are kept in the kernel cache: they are those that would be composed, or composed again."""

import os
import time
from dataclasses import replace

import pytest
import warp as wp
from law_rows import rules_of

from warpdyn.engine.kernels import build, composition
from warpdyn.engine.kernels.composing import kept_texts
from warpdyn.engine.kernels.plan import Plan

TEXT = kept_texts.Text("def integrate():\n    pass\n", frozenset({"a", "wp"}), frozenset({"wp"}))


@pytest.fixture
def cache(monkeypatch, tmp_path):
    """Return an empty kernel cache."""
    kept_texts.initialise()
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path))
    return tmp_path / kept_texts.FOLDER


def kept(determined_by="plan"):
    """Return the kept text, and how often it was composed."""
    composed = []
    text = kept_texts.kept_text(determined_by, lambda: composed.append(1) or TEXT)
    return text, len(composed)


def test_a_text_is_composed_once(cache):
    assert kept() == (TEXT, 1)
    assert kept() == (TEXT, 0)
    assert kept("another plan") == (TEXT, 1)
    assert len(list(cache.iterdir())) == 2


def test_old_texts_of_other_versions_are_removed(cache):
    cache.mkdir()
    week = 7 * 86400
    ages = {"before_text.json": 1.1 * week, "text.json": 1.1 * week, "recent_text.json": 0.9 * week}
    for name, age in ages.items():
        (cache / name).write_text("a text")
        os.utime(cache / name, (time.time() - age,) * 2)
    kept()
    [other] = {path.name for path in cache.iterdir()} - ages.keys()
    os.utime(cache / other, (time.time() - 1.1 * week,) * 2)
    kept_texts._remove_old_versions.cache_clear()
    kept("another plan")
    remaining = {path.name for path in cache.iterdir()}
    assert len(remaining) == 3
    assert {"recent_text.json", other} < remaining


@pytest.mark.parametrize("damage", [lambda text: text[:-1], lambda text: text.replace("pass", "post"), lambda text: ""])
def test_a_damaged_text_is_composed_again(cache, damage):
    kept()
    [path] = cache.iterdir()
    path.write_text(damage(path.read_text()))
    assert kept() == (TEXT, 1)
    assert kept() == (TEXT, 0)


def test_a_cache_that_cannot_be_written_keeps_nothing(cache):
    cache.write_text("a file, not a folder")
    assert kept() == (TEXT, 1)
    assert kept() == (TEXT, 1)


def test_a_kept_kernel_is_the_composed_one(cache, monkeypatch):
    plan = Plan("chain", 3, rules_of("bilinear"), "none", "base_acceleration", ("drift",), "rk4", "float32")
    composed = build.composed(build.fitted(plan, False))

    def refuse(*given):
        raise AssertionError("the text was composed again")

    monkeypatch.setattr(composition, "check_parts", refuse)
    monkeypatch.setattr(composition, "_text", refuse)
    assert build.composed(build.fitted(plan, False)) == composed
    with pytest.raises(AssertionError, match="composed again"):
        build.composed(build.fitted(replace(plan, dofs=4), False))
