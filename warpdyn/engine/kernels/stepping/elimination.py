"""Solution of the tridiagonal system of an implicit step: elimination from the top down, substitution upwards."""


def wanted(plan):
    return plan.family == "chain" and plan.kind == "implicit"


def declare():
    of_stiffness = row()  # factor of a stiffness in the matrix
    solved_mass = matrix()  # terms of the matrix besides the tangent stiffness, as a chain
    solved_damping = matrix()
    passed = matrix()  # factor that elimination passes from a floor to the floor below
    inverse_pivot = matrix()
    eliminated = matrix()
    above_eliminated = row()
    carried = row()
    below_found = row()


def begin_walk():
    above_eliminated[j] = dtype(0.0)
    carried[j] = dtype(0.0)


def eliminate():
    if NEWTON or index == 0:
        # A constant matrix is factored once per sample.
        storey = solved_damping[i, j]
        if SOLVES_DRIFT:
            storey += of_stiffness[j] * stiffness
        slot("add_to_storey")
        above_it = solved_mass[i, j] + carried[j]
        inverse_pivot[i, j] = dtype(1.0) / (above_it + storey)
        passed[i, j] = storey * inverse_pivot[i, j]
        carried[j] = passed[i, j] * above_it
    eliminated[i, j] = residual + above_eliminated[j]
    above_eliminated[j] = passed[i, j] * eliminated[i, j]


def substitute():
    for j in range(LANES):
        below_found[j] = dtype(0.0)
    for i in range(N):
        for j in range(LANES):
            found = eliminated[i, j] * inverse_pivot[i, j] + passed[i, j] * below_found[j]
            below_found[j] = found
            change = dtype(0.0)
            if SEARCH:
                slot("choose_change")
            elif h[j] > dtype(0.0):
                change = found
            reach = theta * h[j]
            rise[i, j] += change
            us[i, j] += beta * reach * reach * change
            vs[i, j] += gamma * reach * change
