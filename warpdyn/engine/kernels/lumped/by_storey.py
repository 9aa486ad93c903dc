"""Lumped structures of equal storeys: loops over the storeys compute deformations, forces and accelerations.

On a CPU a thread computes all storeys. On a GPU several threads share a sample, and each computes some of the storeys
(a section). As many samples as possible share the 32 threads of a warp: with five sections, for example, six samples.
The other threads of the warp are idle: their state is always 0, as that of the ground below the first storey and of the
missing storey above the last one. A stage of the method needs two exchanges between threads: the state of the floor
below the section, and the forces of the storey above it.
"""

from warpdyn.engine.device.warp_exchange import across_warp
from warpdyn.engine.kernels.lumped.pattern import UNIT
from warpdyn.engine.kernels.lumped.storeys import statements, transposed

order = -10


def wanted(plan):
    return plan.storeys is not None


def names(plan):
    import warp as wp

    from warpdyn.engine.device.warp_exchange import EXCHANGES, number_at
    from warpdyn.engine.kernels.plan import DTYPES, WARP, state_of_stage

    dtype, storeys, threads = DTYPES[plan.dtype], plan.storeys, plan.sections
    of_thread, width, springs = storeys.count // threads, storeys.width, len(storeys.springs[0])
    common, own = len(storeys.common), len(storeys.own)
    dashpots = plan.pattern.has_dashpots
    neighbour, neighbour_or_zero, together = EXCHANGES[plan.dtype]
    texts = _texts(storeys, plan.pattern.components, *state_of_stage(plan))
    return {
        "THREADS": threads,
        "THREADS_OF_WARP": WARP,
        "LAST_THREAD": WARP - 1,  # idle if a warp is not filled by whole samples
        "AFTER_LAST_SAMPLE": 2**30 - 1,
        "SAMPLES_OF_WARP": WARP // threads,
        "HAS_IDLE_THREADS": threads > 1 and WARP % threads > 0,
        "FLOORS": of_thread,
        "WIDTH": width,
        "SPRINGS_OF_STOREY": springs,
        "COMMON": common,
        "OWN": own,
        "HAS_DASHPOTS": dashpots,
        "FIRST_DASHPOT": common + of_thread * own,
        "FIRST_DASHPOT_OF_STRUCTURE": plan.pattern.values,
        "ROWS": of_thread * springs,
        "TERMS": common + of_thread * own + (of_thread * springs if dashpots else 0),
        "IS_SHAKEN": True,
        "HAS_UNMOVED": False,
        "ALL_RELATIVE": all(storeys.relative),
        "from_thread": neighbour if WARP % threads else neighbour_or_zero,
        "over_sections": together,
        "dof_number": number_at([dof for row in storeys.dofs for dof in row]),
        "spring_number": number_at([spring for row in storeys.springs for spring in row]),
        "code_of_value": number_at([*storeys.common, *(row[at] for at in range(storeys.count) for row in storeys.own)]),
        "term_rows": wp.types.matrix(
            shape=(max(1, common + of_thread * own + (of_thread * springs if dashpots else 0)), plan.lanes), dtype=dtype
        ),
        "spring_rows": wp.types.matrix(shape=(of_thread * springs, plan.lanes), dtype=dtype),
        "floor_rows": wp.types.matrix(shape=(width, plan.lanes), dtype=dtype),
        # Statements for one storey, whose index in the thread is `floor`.
        "STOREY_DEFORMATIONS": texts["STOREY_DEFORMATIONS"],
        "STOREY_RATES": texts["STOREY_RATES"],
        "STOREY_FORCES": texts["STOREY_FORCES"],
        "FOOTINGS": texts["FOOTINGS"],
        "FLOOR_ACCELERATIONS": texts["FLOOR_ACCELERATIONS"],
        "FLOOR_BASE_ACCELERATIONS": texts["FLOOR_BASE_ACCELERATIONS"],
        "STOREY_OUTPUTS": texts["STOREY_OUTPUTS"],
    }


def _texts(storeys, components, displacement, velocity):
    """Return the statements for one storey, whose index in the thread is the variable `floor`."""
    common, own, springs = len(storeys.common), len(storeys.own), len(storeys.springs[0])

    def value(place):
        if place == UNIT or place < common:
            return f"terms[{place}, j]"
        return f"terms[{common} + floor * {own} + {place - common}, j]"

    def moved(absolute, relative, below):
        def factor(entry):
            if storeys.relative[entry.column]:
                return f"{relative}[{entry.column}, j]"
            if entry.is_below:
                return f"{below}[{entry.column}, j]"
            return f"{absolute}[floor * {storeys.width} + {entry.column}, j]"

        return factor

    def of_spring(name):
        return lambda row: f"{name}[floor * {springs} + {row}, j]"

    def of_floor(name):
        return lambda row: f"{name}[floor * {storeys.width} + {row}, j]"

    def force(entry):
        return f"spring_force[floor * {springs} + {entry.column}, j]"

    ground = (lambda entry: f"ground[{entry.column}, j]") if components > 1 else (lambda entry: "base[j]")
    outputs = len(storeys.outputs[0]) if storeys.outputs else 0
    above = transposed(storeys.deformation, storeys.width, is_below=False)
    under = transposed(storeys.deformation, storeys.width, is_below=True)
    of_relative = [
        f"footing[floor * {storeys.width} + {at}, j] = storey_force[floor * {storeys.width} + {at}, j]"
        for at in range(storeys.width)
        if storeys.relative[at]
    ]
    of_others = tuple(() if storeys.relative[at] else under[at] for at in range(storeys.width))
    footings = [
        line
        for line in statements(of_others, of_floor("footing"), force, value, sign=-1).splitlines()
        if not line.endswith("= dtype(0.0)")
    ]
    return {
        "STOREY_DEFORMATIONS": statements(
            storeys.deformation, of_spring("deformation"), moved(displacement, "relative_u", "lower_u"), value
        ),
        "STOREY_RATES": statements(
            storeys.deformation, of_spring("deformation_rate"), moved(velocity, "relative_v", "lower_v"), value
        ),
        "STOREY_FORCES": statements(above, of_floor("storey_force"), force, value),
        "FOOTINGS": "\n".join([*of_relative, *footings]) or "pass",
        "FLOOR_ACCELERATIONS": statements(
            storeys.inverse_mass, of_floor("felt"), lambda entry: f"net_force[{entry.column}, j]", value
        ),
        "FLOOR_BASE_ACCELERATIONS": statements(storeys.drive, of_floor("shaken"), ground, value),
        "STOREY_OUTPUTS": statements(
            storeys.output,
            lambda row: f"present_output[floor * {outputs} + {row}, j]",
            moved("u", "relative_u", "lower_u"),
            value,
        ),
    }


def place():
    section = int(0)
    lowest = int(0)
    if THREADS > 1:
        slot("share_warp")


def share_warp():
    thread = block % THREADS_OF_WARP
    block = (block // THREADS_OF_WARP) * SAMPLES_OF_WARP + thread // THREADS
    section = thread % THREADS
    lowest = section * FLOORS
    thread_below = thread - 1
    thread_above = thread + 1
    first_thread = thread - section
    if HAS_IDLE_THREADS:
        if section == 0:
            thread_below = int(LAST_THREAD)
        if section == THREADS - 1:
            thread_above = int(LAST_THREAD)
        if thread >= SAMPLES_OF_WARP * THREADS:
            thread_below = int(LAST_THREAD)
            thread_above = int(LAST_THREAD)
            block = int(AFTER_LAST_SAMPLE)
    else:
        if section == 0:
            thread_below = int(-1)
        if section == THREADS - 1:
            thread_above = int(-1)


def declare():
    lower_u = floor_rows()  # displacement and velocity of the floor below the present storey
    lower_v = floor_rows()
    relative_u = floor_rows()  # those of the floor above the storey, relative to the floor below
    relative_v = floor_rows()
    storey_force = matrix()  # forces of a storey's springs on the floor above the storey
    footing = matrix()  # on the floor below it, in the opposite direction
    upper_footing = floor_rows()
    net_force = floor_rows()


def read_lane():
    if HAS_IDLE_THREADS:
        if thread >= SAMPLES_OF_WARP * THREADS:  # nothing accelerates an idle thread
            scale[j] = dtype(0.0)


def read_sample():
    for q in range(COMMON + FLOORS * OWN):
        at_value = q
        if q >= COMMON:
            at_value = q + lowest * OWN
        code = code_of_value(at_value)
        terms[q, j] = dtype(code)
        if code > 1:
            terms[q, j] = structures.terms[code - 2, s]
        if code < -1:
            terms[q, j] = -structures.terms[-code - 2, s]
    if HAS_DASHPOTS:
        for q in range(ROWS):
            dashpot_row = FIRST_DASHPOT_OF_STRUCTURE + spring_number(lowest * SPRINGS_OF_STOREY + q)
            terms[FIRST_DASHPOT + q, j] = structures.terms[dashpot_row, s]
    if HAS_IDLE_THREADS:
        if thread >= SAMPLES_OF_WARP * THREADS:
            for q in range(TERMS):
                terms[q, j] = dtype(0.0)


def start():
    if THREADS > 1:
        intervals = across_warp(intervals)  # the threads of a warp exchange values at every stage


def gather_springs():
    slot("find_lower_floor")
    for floor in range(FLOORS):
        for j in range(LANES):
            slot("compare_floors")
            STOREY_DEFORMATIONS
            STOREY_RATES
            slot("leave_floor")


def find_lower_floor():
    for j in range(LANES):
        for k in range(WIDTH):
            if THREADS > 1:
                lower_u[k, j] = from_thread(us[(FLOORS - 1) * WIDTH + k, j], thread_below)
                lower_v[k, j] = from_thread(vs[(FLOORS - 1) * WIDTH + k, j], thread_below)
            else:
                lower_u[k, j] = dtype(0.0)
                lower_v[k, j] = dtype(0.0)


def compare_floors():
    for k in range(WIDTH):
        relative_u[k, j] = us[floor * WIDTH + k, j] - lower_u[k, j]
        relative_v[k, j] = vs[floor * WIDTH + k, j] - lower_v[k, j]


def leave_floor():
    for k in range(WIDTH):
        lower_u[k, j] = us[floor * WIDTH + k, j]
        lower_v[k, j] = vs[floor * WIDTH + k, j]


# The same for accepted states: recorders see them after the displacements of the next stage are computed.
def find_accepted_floor():
    for j in range(LANES):
        for k in range(WIDTH):
            if THREADS > 1:
                lower_u[k, j] = from_thread(u[(FLOORS - 1) * WIDTH + k, j], thread_below)
            else:
                lower_u[k, j] = dtype(0.0)


def compare_accepted_floors():
    for k in range(WIDTH):
        relative_u[k, j] = u[floor * WIDTH + k, j] - lower_u[k, j]


def leave_accepted_floor():
    for k in range(WIDTH):
        lower_u[k, j] = u[floor * WIDTH + k, j]


def evaluate_storeys():
    slot("find_lower_floor")
    for floor in range(FLOORS):
        for j in range(LANES):
            slot("compare_floors")
            STOREY_DEFORMATIONS
            STOREY_RATES
            slot("leave_floor")
            for spring in range(SPRINGS_OF_STOREY):
                i = floor * SPRINGS_OF_STOREY + spring
                slot("visit_spring_of_lane")
            STOREY_FORCES
            FOOTINGS


def sum_up_springs():
    for floor in range(FLOORS):
        for j in range(LANES):
            STOREY_FORCES
            FOOTINGS


def gather_forces():
    slot("find_upper_forces")
    for down in range(FLOORS):
        floor = FLOORS - 1 - down
        for j in range(LANES):
            slot("accelerate_floor")


def accelerate_storeys():
    slot("find_upper_forces")
    for down in range(FLOORS):
        floor = FLOORS - 1 - down
        for j in range(LANES):
            slot("accelerate_floor")
            for k in range(WIDTH):
                i = floor * WIDTH + k
                slot("accelerate_dof")


def find_upper_forces():
    for j in range(LANES):
        for k in range(WIDTH):
            if THREADS > 1:
                upper_footing[k, j] = from_thread(footing[k, j], thread_above)
            else:
                upper_footing[k, j] = dtype(0.0)


def accelerate_floor():
    for k in range(WIDTH):
        net_force[k, j] = upper_footing[k, j] - storey_force[floor * WIDTH + k, j]
        upper_footing[k, j] = footing[floor * WIDTH + k, j]
    FLOOR_ACCELERATIONS
    FLOOR_BASE_ACCELERATIONS


def after_finish():
    if THREADS > 1:
        total = over_sections(total, first_thread, THREADS)
