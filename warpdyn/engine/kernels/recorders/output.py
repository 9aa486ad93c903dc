"""The largest value of every output of a lumped structure: a linear combination of its displacements."""

from warpdyn.foundations.core.output_variables import Variable

order = 10
VARIABLES = {
    "lumped": {
        "peak_output": Variable(("output",), "1", "peak absolute value of the output, in the unit of the output")
    }
}


def wanted(plan):
    return "output" in plan.recorders


def values_held(plan):
    return plan.length("output")


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.lumped.assembly import first_places
    from warpdyn.engine.kernels.lumped.pattern import products
    from warpdyn.engine.kernels.plan import DTYPES

    pattern, count = plan.pattern, plan.length("output")
    text = products(
        pattern.output,
        "terms",
        lambda dof: f"u[{dof}, j]",
        lambda place: f"present_output[{place}, j]",
        first=first_places(pattern)["output"],
    )
    return {
        "OUTPUTS": count,
        "PRESENT_OUTPUTS": text or "pass",
        "output_rows": wp.types.matrix(shape=(max(1, count), plan.lanes), dtype=DTYPES[plan.dtype]),
    }


def declare():
    present_output = output_rows()
    peak_output = output_rows()


def see_state():
    PRESENT_OUTPUTS
    for j in range(LANES):
        for m in range(OUTPUTS):
            size = wp.abs(present_output[m, j])
            if SPRING_COLLAPSE:
                size = size * stands[j]
            peak_output[m, j] = larger(peak_output[m, j], size)


def restart_recorders():
    for m in range(OUTPUTS):
        peak_output[m, j] = dtype(0.0)


def write():
    for m in range(OUTPUTS):
        output.peak_output[m, o] = peak_output[m, j]
