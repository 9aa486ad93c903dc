"""The largest value of every output of a lumped structure: a linear combination of its displacements, or a resultant.

A resultant is the square root of the sum of the squares of several linear combinations at each time.
"""

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
    return len(plan.pattern.output.rows)


def names(plan):
    import warp as wp

    from warpdyn.engine.kernels.lumped.assembly import first_places
    from warpdyn.engine.kernels.lumped.pattern import products
    from warpdyn.engine.kernels.plan import DTYPES

    pattern, count = plan.pattern, plan.length("output")
    rows = max(1, len(pattern.output.rows) // (1 if plan.storeys is None else plan.sections))
    if plan.floors:  # each thread has every THREADS-th output
        from warpdyn.engine.kernels.grids.shared_floors import element
        from warpdyn.engine.kernels.hinges.floor_matrices import row_product, statements_of

        of_thread = plan.floors.rows["output"]
        count, rows = len(of_thread), max(1, len(of_thread))
        lines = []
        for place, row in enumerate(of_thread):
            target = f"present_output[{place}, j]"
            lines += [f"{target} = dtype(0.0)", *row_product(row, target, element("u", row.is_full))]
        own = {"PRESENT_OUTPUTS": statements_of(lines), "number_of_output": "m * THREADS + section"}
    elif plan.storeys is None:
        text = products(
            pattern.output,
            "terms",
            lambda dof: f"u[{dof}, j]",
            lambda place: f"present_output[{place}, j]",
            first=first_places(pattern)["output"],
        )
        own = {"PRESENT_OUTPUTS": text or "pass", "number_of_output": "m"}
    else:  # the outputs of the storeys of this thread
        from warpdyn.engine.device.warp_exchange import number_at

        count //= plan.sections
        listed = number_at([each for row in plan.storeys.outputs for each in row])
        own = {"output_number": listed, "number_of_output": "output_number(section * OUTPUTS + m)"}
    return {
        "OUTPUTS": count,
        "ALL_OUTPUTS": plan.length("output"),
        **own,
        "RESULTANTS": resultants(pattern) or "pass",
        "output_rows": wp.types.matrix(shape=(rows, plan.lanes), dtype=DTYPES[plan.dtype]),
    }


def resultants(pattern):
    """Return statements that replace the first row of each resultant by the root of the sum of all squares."""
    lines = []
    for place, others in enumerate(pattern.resultants):
        if others:
            squares = [f"present_output[{row}, j] * present_output[{row}, j]" for row in (place, *others)]
            lines.append(f"present_output[{place}, j] = {squares[0]}")
            lines += [f"present_output[{place}, j] += {square}" for square in squares[1:]]
            lines.append(f"present_output[{place}, j] = wp.sqrt(present_output[{place}, j])")
    return "\n    ".join(["for j in range(LANES):", *lines]) if lines else ""


def declare():
    present_output = output_rows()
    peak_output = output_rows()


def see_state():
    if BY_STOREY:
        slot("find_accepted_floor")
        for floor in range(FLOORS):
            for j in range(LANES):
                slot("compare_accepted_floors")
                STOREY_OUTPUTS
                slot("leave_accepted_floor")
    else:
        PRESENT_OUTPUTS
        RESULTANTS
    for m in range(OUTPUTS):
        for j in range(LANES):
            size = wp.abs(present_output[m, j])
            if SPRING_COLLAPSE:
                size = size * stands[j]
            peak_output[m, j] = larger(peak_output[m, j], size)


def restart_recorders():
    for m in range(OUTPUTS):
        peak_output[m, j] = dtype(0.0)


def finish_rows():
    for m in range(OUTPUTS):
        if number_of_output < ALL_OUTPUTS if SHARED_FLOORS else ONCE:
            output.peak_output[number_of_output, o] = peak_output[m, j]
