"""Users' recorders may write only their own variables, and their indices must fit; messages name the file and line."""

import re

import numpy as np
import pytest

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.usefixtures("forgotten_recorders")]

BUILDING = wd.ShearBuilding(np.full(3, 1e5), [8e7, 6e7, 4e7], 3.0, damping="rayleigh", damping_ratio=0.05)
MOTION = wd.GroundMotion(4.0 * np.sin(0.2 * np.arange(200)), 0.01, "sine")
OF_STOREYS, OF_SAMPLE = wd.kernels.Variable(("storey",), "N", "force"), wd.kernels.Variable((), "N", "force")

BODY = """
class Force(wd.kernels.Recorder):
    VARIABLES = {{"chain": {{"my_forces": OF_STOREYS, "my_force": OF_SAMPLE}}}}

    def declare():
        force = matrix()
        biggest = row()

    def see_forces():
        force[i, j] = larger(force[i, j], wp.abs(restoring))
        biggest[j] = larger(biggest[j], wp.abs(restoring))

    def finish_storey():
        {in_storey}

    def write():
        {in_sample}
"""
STOREYS, SAMPLE = "output.my_forces[g, o] = force[i, j]", "output.my_force[o] = biggest[j]"


def added(first, second):
    return f"{first}\n        {second}"


def recorder(tmp_path, in_storey=STOREYS, in_sample=SAMPLE, text=""):
    """Return a recorder that is defined in a file, with these statements or this text."""
    file = tmp_path / "force.py"
    file.write_text(text or BODY.format(in_storey=in_storey, in_sample=in_sample))
    names = {"wd": wd, "OF_STOREYS": OF_STOREYS, "OF_SAMPLE": OF_SAMPLE, "__name__": "force"}
    exec(compile(file.read_text(), str(file), "exec"), names)
    return names["Force"], file


FAULTS_IN_STOREY = {
    "output.peak_storey_drift[g, o] = force[i, j]": "writes output.peak_storey_drift, a variable of recorder 'drift'; "
    "it may write output.my_forces, output.my_force",
    "output.peak_storey_drift[g, o] += force[i, j]": "writes output.peak_storey_drift, a variable of recorder 'drift'",
    "output.status[o] = ok": "writes output.status, which is not in its VARIABLES",
    "history.displacement[g, o] = force[i, j]": "writes history.displacement, which is not in its VARIABLES",
    "wp.atomic_add(output.peak_storey_drift, g, o, force[i, j])": "writes output.peak_storey_drift",
    "other = output.peak_storey_drift": "writes output.peak_storey_drift, a variable of recorder 'drift'",
    "force[i, j] = output.peak_floor_acceleration[g, o]": "reads output.peak_floor_acceleration, but the scene has no "
    "recorder 'acceleration'",
    "other = output": "uses output as a whole",
    "output.my_forces[i, o] = force[i, j]": r"indexes output.my_forces[i, o], but its first index is the storey in the "
    "building; write output.my_forces[g, o]",
    "output.my_forces[o, g] = force[i, j]": "its last index is the column of the sample; write output.my_forces[g, o]",
    "output.my_forces[g, sample[j]] = force[i, j]": "its last index is the column of the sample",
    "output.my_forces[o] = force[i, j]": "indexes output.my_forces[o], but it has one value per storey and sample by "
    "VARIABLES; write output.my_forces[g, o]",
    "output.my_forces[3, o] = force[i, j]": "indexes output.my_forces[3, o], but the index 3 is not in 0 to 2",
    "output.my_forces[STOREYS, o] = force[i, j]": "the index 3 is not in 0 to 2",
    "output.my_forces[-1, o] = force[i, j]": "the index -1 is not in 0 to 2",
    "output.my_forces[g, o] = force[3, j]": "indexes force[3, j], but the index 3 is not in 0 to 2",
    "output.my_forces[g, o] = force[N, j]": "indexes force[N, j], but the index 3 is not in 0 to 2",
    "output.my_forces[g, o] = force[3][j]": "indexes force[3, j], but the index 3 is not in 0 to 2",
    "output.my_forces[g, o] = force[j, i]": "the last index of force is the lane: force[i, j]",
    "output.my_forces[g, o] = force[g, j]": "the first index of force is the storey in the thread: force[i, j]",
    "output.my_forces[g, o] = force[i, 0]": "the last index of force is the lane: force[i, j]",
    "output.my_forces[g, o] = force[i]": "indexes force[i], but force has 2 indices: force[i, j]",
    "output.my_forces[g, o] = biggest[i]": "the last index of biggest is the lane: biggest[j]",
    "output.my_forces[g, o] = mass[4, j]": "indexes mass[4, j], but the index 4 is not in 0 to 2",
}
FAULTS_IN_SAMPLE = {
    "output.my_force[0] = biggest[j]": "indexes output.my_force[0], but its last index is the column of the sample",
    "output.my_force[j] = biggest[j]": "indexes output.my_force[j], but its last index is the column of the sample",
    "output.my_force[0, o] = biggest[j]": "has one value per sample by VARIABLES; write output.my_force[o]",
}


def check_refused(tmp_path, slot, fault, statement, **statements):
    recorder_class, file = recorder(tmp_path, **statements)
    line = 1 + file.read_text().splitlines().index(f"        {statement}")
    scene = wd.Scene(BUILDING, wd.Cloud([MOTION]), recorders=("drift", recorder_class))
    with pytest.raises(ValueError, match=re.escape(fault)) as raised:
        wd.simulate(scene, device="cpu")
    assert str(raised.value).startswith(f"part 'force' ({file}, line {line}): {slot}() ")


@pytest.mark.parametrize("statement", FAULTS_IN_STOREY)
def test_faulty_statements_of_a_storey_are_refused(tmp_path, statement):
    check_refused(
        tmp_path, "finish_storey", FAULTS_IN_STOREY[statement], statement, in_storey=added(STOREYS, statement)
    )


@pytest.mark.parametrize("statement", FAULTS_IN_SAMPLE)
def test_faulty_statements_of_a_sample_are_refused(tmp_path, statement):
    check_refused(tmp_path, "write", FAULTS_IN_SAMPLE[statement], statement, in_sample=added(SAMPLE, statement))


def test_branches_that_a_kernel_does_not_have_are_not_checked(tmp_path):
    for condition in ("IS_CHAIN", "not IS_CHAIN"):
        inside = f"if {condition}:\n            output.peak_storey_drift[g, o] = force[7, j]"
        scene = scene_of(recorder(tmp_path, in_storey=added(STOREYS, inside))[0])
        if condition == "IS_CHAIN":
            with pytest.raises(ValueError, match=r"writes output\.peak_storey_drift"):
                wd.kernels.source(scene, device="cpu")
        else:
            assert "[7, j]" not in wd.kernels.source(scene, device="cpu")


def scene_of(recorder_class):
    return wd.Scene(BUILDING, wd.Cloud([MOTION]), recorders=("drift", recorder_class))


def test_constant_indices_within_the_shape_are_right(tmp_path):
    statement = "output.my_force[o] = force[N - 1, j] / output.peak_storey_drift[STOREYS - 1, o]"
    recorder_class, _ = recorder(tmp_path, in_sample=statement)
    run = wd.simulate(scene_of(recorder_class), device="cpu", dtype="float64")
    # The force of an elastic storey is its stiffness times its drift; one unit of float64's rounding per operation.
    np.testing.assert_allclose(run["my_force"], 4e7, rtol=1e-12)


def test_a_variable_that_another_recorder_sets_is_refused_in_the_users_file(tmp_path):
    text = BODY.format(in_storey=STOREYS, in_sample=SAMPLE).replace("biggest", "largest")
    recorder_class, file = recorder(tmp_path, text=text)
    line = 1 + text.splitlines().index("        largest = row()")
    fault = rf"part 'force' \({file}, line {line}\): declare\(\) declares 'largest', which part 'drift' sets"
    with pytest.raises(ValueError, match=fault):
        wd.kernels.source(scene_of(recorder_class), device="cpu")


ONE_LINE = """
class Force(wd.kernels.Recorder):
    VARIABLES = {"chain": {"my_forces": OF_STOREYS, "my_force": OF_SAMPLE}}
    def declare(): force = matrix(); count = row()
    def see_forces():
        if i == 0: count[j] += dtype(1.0); count[j] += dtype(1.0)  # two per step
        size = wp.abs(restoring); force[i, j] = larger(force[i, j], size)
    def finish_storey(): output.my_forces[g, o] = force[i, j]
    def write(): "The number of steps."; output.my_force[o] = count[j]
"""


def test_statements_on_one_line_run_once(tmp_path):
    recorder_class, file = recorder(tmp_path, text=ONE_LINE)
    run = wd.simulate(scene_of(recorder_class), device="cpu", dtype="float64", step=0.01, histories=wd.Histories([0]))
    # One state per step and the first one; the history has the same states.
    assert run["my_force"].item() == 2 * run.sizes["time"]
    np.testing.assert_allclose(run["my_forces"][0], abs(run["storey_force"][0]).max("time"), rtol=1e-9)
    recorder_class, file = recorder(
        tmp_path, text=ONE_LINE.replace("force[i, j]\n    def write", "forc[i, j]\n    def write")
    )
    line = 1 + next(at for at, text in enumerate(file.read_text().splitlines()) if "forc[i" in text)
    with pytest.raises(ValueError, match=rf"force.py, line {line}\): finish_storey\(\) reads 'forc'.*'force'"):
        wd.kernels.source(scene_of(recorder_class), device="cpu")
