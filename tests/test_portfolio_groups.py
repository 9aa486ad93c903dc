"""Groups of a portfolio: each begins while the one before it runs, and says what it has to say in its turn."""

import re
import threading
import time

import numpy as np
import pytest
from test_portfolio import CITY, MOTIONS, simulate

import warpdyn as wd
from warpdyn.campaigns.running.regions import job, workers as module
from warpdyn.foundations.core.messages import warn_caller

pytestmark = pytest.mark.meant_as_given("first_period", "yield_base_shear_coefficient")


def test_a_group_begins_while_the_one_before_runs(monkeypatch):
    settings = {"tail": 0.0, "recorders": ("drift",), "device": "cpu"}
    city = simulate(CITY, MOTIONS[0], **settings)
    begun, order = [threading.Event() for _ in range(5)], []

    class Told(module.Region):
        def __init__(self, *settings, **options):
            super().__init__(*settings, **options)
            self.number = sum(event.is_set() for event in begun)
            begun[self.number].set()

        def finish(self, advance):
            order.append(self.number)
            if self.number < 4:
                assert begun[self.number + 1].wait(60)
            return super().finish(advance)

    monkeypatch.setattr(module, "Region", Told)
    found = simulate(CITY, MOTIONS[0], **settings)
    assert order == [0, 1, 2, 3, 4]
    for name in city.variables:
        np.testing.assert_array_equal(found[name].values, city[name].values, err_msg=name)


def test_warnings_and_errors_of_a_group_that_begins_ahead_come_in_its_turn(monkeypatch):
    finished = []

    class Warns(module.Region):
        def __init__(self, host, job, *settings, **options):
            warn_caller("this one is odd")
            if job.scene.structure.dofs == 3:
                raise ValueError("this one is refused")
            super().__init__(host, job, *settings, **options)

        def finish(self, advance):
            finished.append(super().finish(advance))
            return finished[-1]

    monkeypatch.setattr(module, "Region", Warns)
    with (
        pytest.warns(UserWarning, match="odd") as given,
        pytest.raises(ValueError, match=r"of 3 storeys .*: this one is refused"),
    ):
        simulate(CITY, MOTIONS[0], tail=0.0, recorders=("drift",), device="cpu")
    odd = [warning for warning in given if "odd" in str(warning.message)]
    assert len(odd) - 1 == len(finished) > 0  # the last one is of the group that is refused
    assert "of 3 storeys" in str(odd[-1].message)
    assert all(
        "buildings of" in str(warning.message) and warning.filename == simulate.__code__.co_filename for warning in odd
    )


def test_warnings_of_a_group_in_regions_come_in_every_run(tmp_path):
    # What is prepared of a run is kept for the next one like it, and so is what was said of it.
    city = wd.Portfolio({name: CITY.archetypes[name] for name in ("low", "house")})
    for number in range(2):
        settings = {"step": 0.01, "resample": True, "path": tmp_path / f"{number}.zarr"}
        with pytest.warns(UserWarning, match="resampled") as given:
            simulate(city, wd.Cloud(MOTIONS[:2]), tail=0.0, recorders=("drift",), device="cpu", **settings).close()
        told = [str(warning.message) for warning in given if "resampled" in str(warning.message)]
        assert len(told) == len(set(told)) == 2
        assert all(re.search(r"^\d+ buildings? of \d storeys?", message) for message in told)


def test_no_group_begins_before_its_turn_where_memory_is_bounded(monkeypatch):
    order = []

    class Told(module.Region):
        def __init__(self, *given, **options):
            super().__init__(*given, **options)
            order.append("begun")

        def finish(self, advance):
            time.sleep(0.05)  # in which another would begin
            order.append("run")
            return super().finish(advance)

    monkeypatch.setattr(module, "Region", Told)
    opened, open_queues = [], job.open_queues

    def opening(*given):
        opened.append(given)
        return open_queues(*given)

    monkeypatch.setattr(job, "open_queues", opening)
    simulate(CITY, MOTIONS[0], tail=0.0, recorders=("drift",), device="cpu", memory=2**27)
    assert order == ["begun", "run"] * 5
    assert len(opened) == 5  # each group has its own places on the devices
