"""Recorders that a user defines in a script: they are registered, checked, and work in other processes."""

import subprocess
import sys
import textwrap

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.engine.kernels.composing.source_text import bodies_of
from warpdyn.foundations.core.description import fingerprint

pytestmark = pytest.mark.usefixtures("forgotten_recorders")

BUILDING = wd.ShearBuilding(
    np.full(3, 1e5), [8e7, 6e7, 4e7], 3.0, law="bilinear", yield_force=2e5, hardening_ratio=0.05, damping="rayleigh",
    damping_ratio=0.05,
)  # fmt: skip
MOTION = wd.GroundMotion(4.0 * np.sin(0.2 * np.arange(200)), 0.01, "sine")
ELASTIC = wd.ShearBuilding(np.full(3, 1e5), [8e7, 6e7, 4e7], 3.0, damping="rayleigh", damping_ratio=0.05)


def storey_force():
    class StoreyForce(wd.kernels.Recorder):
        """The largest restoring force of every storey."""

        VARIABLES = {"chain": {"peak_storey_force": wd.kernels.Variable(("storey",), "N", "peak storey force")}}

        def declare():
            peak_force = matrix()

        def see_forces():
            peak_force[i, j] = larger(peak_force[i, j], wp.abs(restoring))

        def finish_storey():
            output.peak_storey_force[g, o] = peak_force[i, j]

    return StoreyForce


@pytest.mark.parametrize(("building", "method"), [(BUILDING, "rk4"), (BUILDING, "newmark_average"), (ELASTIC, "exact")])
def test_a_user_recorder_equals_the_peak_of_the_history(building, method):
    scene = wd.Scene(building, wd.Cloud([MOTION]), recorders=("drift", storey_force()))
    run = wd.simulate(scene, method=method, histories=wd.Histories([0]), device="cpu", dtype="float64")
    due = abs(run["storey_force"]).max("time")
    np.testing.assert_allclose(run["peak_storey_force"][0], due[0], rtol=1e-9)
    assert run["peak_storey_force"].attrs["units"] == "N"


@pytest.mark.fast
def test_other_scenes_keep_their_kernels():
    scene = wd.Scene(BUILDING, wd.Cloud([MOTION]))
    before = wd.kernels.source(scene, device="cpu")
    storey_force()
    again = wd.Scene(BUILDING, wd.Cloud([MOTION]))
    assert again.recorders == scene.recorders
    assert wd.kernels.source(again, device="cpu") == before


@pytest.mark.fast
def test_a_recorder_that_is_defined_again_replaces_the_first():
    def define(factor):
        class Shear(wd.kernels.Recorder):
            VARIABLES = {"chain": {"my_shear": wd.kernels.Variable((), "N", "shear")}}

            def declare():
                my_peak = row()

            def see_forces():
                if i == 0:
                    my_peak[j] = larger(my_peak[j], wp.abs(restoring))

            if factor == 2:

                def write():
                    output.my_shear[o] = dtype(2.0) * my_peak[j]

            else:

                def write():
                    output.my_shear[o] = my_peak[j]

        return Shear

    texts, prints = [], []
    for factor in (1, 2):
        scene = wd.Scene(BUILDING, wd.Cloud([MOTION]), recorders=(define(factor),))
        texts.append(wd.kernels.source(scene, device="cpu"))
        prints.append(fingerprint(scene))
    assert "dtype(2.0) * my_peak" in texts[1]
    assert "dtype(2.0) * my_peak" not in texts[0]
    assert prints[0] != prints[1]  # the fingerprint covers the source


@pytest.mark.fast
def test_a_faulty_recorder_is_refused():
    class Misspelt(wd.kernels.Recorder):
        VARIABLES = {"chain": {"mine": wd.kernels.Variable((), "N", "shear")}}

        def see_force():
            wp.abs(restoring)

    scene = wd.Scene(BUILDING, wd.Cloud([MOTION]), recorders=("misspelt",))
    with pytest.raises(
        ValueError, match=r"part 'misspelt' .*test_user_recorders.py, line \d+.*did you mean 'see_forces'"
    ):
        wd.simulate(scene, device="cpu")


@pytest.mark.fast
def test_names_and_variables_of_other_recorders_are_refused():
    variable = wd.kernels.Variable((), "N", "shear")
    bodies = {name: each for name, each in vars(storey_force()).items() if name in bodies_of(storey_force())}

    def define(name, **variables):
        return type(name, (wd.kernels.Recorder,), {**bodies, "VARIABLES": {"chain": variables}})

    with pytest.raises(ValueError, match="recorder Drift: 'drift' is a recorder of warpdyn; rename the class"):
        define("Drift", mine=variable)
    with pytest.raises(ValueError, match="recorder Mine: recorder 'drift' writes 'peak_storey_drift', too"):
        define("Mine", peak_storey_drift=variable)
    with pytest.raises(TypeError, match="is not a Variable"):
        define("Mine", mine="N")
    with pytest.raises(TypeError, match="recorder Mine: VARIABLES must be a dictionary such as"):
        type("Mine", (wd.kernels.Recorder,), dict(bodies))


SCRIPT = """
import sys, numpy as np, warpdyn as wd

class StoreyForce(wd.kernels.Recorder):
    VARIABLES = {"chain": {"peak_storey_force": wd.kernels.Variable(("storey",), "N", "peak storey force")}}

    def declare():
        peak_force = matrix()

    def see_forces():
        peak_force[i, j] = larger(peak_force[i, j], wp.abs(restoring))

    def finish_storey():
        output.peak_storey_force[g, o] = peak_force[i, j]

def scene(storeys, law="elastic", **parameters):
    building = wd.ShearBuilding(np.full(storeys, 1e5), 8e7, 3.0, law=law, **parameters)
    motion = wd.GroundMotion(4.0 * np.sin(0.2 * np.arange(100)), 0.01, "sine")
    return wd.Scene(building, wd.Cloud([motion]), recorders=(StoreyForce,))

if __name__ == "__main__":
    BODY
"""


def run_script(tmp_path, body):
    """Run a script that defines a recorder in `__main__`; return the lines that it prints."""
    file = tmp_path / "script.py"
    file.write_text(SCRIPT.replace("BODY", textwrap.indent(textwrap.dedent(body), "    ").strip()))
    done = subprocess.run([sys.executable, file], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_a_recorder_of_a_script_works_in_compile_processes(tmp_path):
    lines = run_script(
        tmp_path,
        """
        from concurrent.futures import Future
        from loky import ProcessPoolExecutor
        from warpdyn.campaigns.integration.model import kernel_text
        from warpdyn.engine.kernels import build

        def text_there(scene):
            import warpdyn as wd
            return wd.kernels.source(scene, device="cpu")

        with ProcessPoolExecutor(1) as pool:
            there = pool.submit(text_there, scene(3)).result()
        print(there == wd.kernels.source(scene(3), device="cpu"), "peak_storey_force" in there)
        """,
    )
    assert lines[-1] == "True True"


def test_a_recorder_of_a_script_works_on_a_cluster(tmp_path):
    pytest.importorskip("distributed")
    lines = run_script(
        tmp_path,
        """
        from distributed import Client, LocalCluster
        with LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
            with Client(cluster) as client:
                there = wd.simulate(scene(2), structures=1, cluster=client, device="cpu")["peak_storey_force"].values
        here = wd.simulate(scene(2), structures=1, device="cpu")["peak_storey_force"].values
        print(np.array_equal(here, there), here.min() > 0)
        """,
    )
    assert lines[-1] == "True True"
