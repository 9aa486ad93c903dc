"""Blocks that several threads prepare at a time, as for a GPU, but on the CPU: nothing they share changes a bit."""

from __future__ import annotations

import threading
import time

import pytest
from test_simulate import assert_same_bits, make_scene

import warpdyn as wd
from warpdyn.campaigns.running import blocks, pipeline
from warpdyn.model.scene.scatter import SAMPLING
from warpdyn.model.scene.sobol_points import SobolPoints

pytestmark = pytest.mark.meant_as_given("storey_height")


@pytest.mark.parametrize("sampling", SAMPLING)
def test_blocks_prepared_side_by_side_change_no_bit(sampling, monkeypatch):
    scene, settings = make_scene(sampling=sampling), {"structures": 24, "seed": 5, "device": "cpu", "threads": 1}
    whole = wd.simulate(scene, **settings)
    prepare, threads = pipeline.Pipeline._prepare, set()

    def prepared(self, item):
        threads.add(threading.get_ident())
        # Later blocks come first, so that what is shared is asked for out of order.
        time.sleep(0.02 * (item[0].start % 3 == 0))
        return prepare(self, item)

    def slowly(draw):
        """Return the function with a pause before and after it, in which another thread may take its turn."""

        def slow(*arguments, **options):
            time.sleep(2e-3)
            result = draw(*arguments, **options)
            time.sleep(2e-3)
            return result

        return slow

    monkeypatch.setattr(SobolPoints, "at", slowly(SobolPoints.at))
    monkeypatch.setattr(pipeline.Pipeline, "_prepare", prepared)
    monkeypatch.setattr(pipeline, "blocks_ahead", lambda run: 4)
    monkeypatch.setattr(blocks, "CPU_BLOCK", 2 * scene.excitation.samples_per_structure)
    assert_same_bits(whole, wd.simulate(scene, **settings))
    assert len(threads) > 1
    assert threading.get_ident() not in threads
