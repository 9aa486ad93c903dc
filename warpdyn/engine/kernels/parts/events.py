"""Event sequences: each event starts with the final state of the last event, and writes its final state."""

FIELDS = {
    "Structure": {
        "initial_displacement": "float[,]",
        "initial_velocity": "float[,]",
        "initial_memory": "float[,]",  # [storey x memory, structure]
    },
    "Output": {
        "final_displacement": "float[,]",
        "final_velocity": "float[,]",
        "final_memory": "float[,]",  # [storey x memory, sample]
    },
}


def wanted(plan):
    return plan.resumes or "state" in plan.recorders


def names(plan):
    return {"RESUMES": plan.resumes, "LEAVES_STATE": "state" in plan.recorders}


def read_storey():
    if RESUMES:
        u[i, j] = structures.initial_displacement[g, s]
        v[i, j] = structures.initial_velocity[g, s]
        if not EXPLICIT_LUMPED:
            for m in range(M):
                z[i * M + m, j] = structures.initial_memory[g * M + m, s]
                if TAKES_MEMORY:
                    zs[i * M + m, j] = z[i * M + m, j]


def read_spring():
    if RESUMES:
        for m in range(M):
            z[i * M + m, j] = structures.initial_memory[i * M + m, s]
            if TAKES_MEMORY:
                zs[i * M + m, j] = z[i * M + m, j]


def remember():
    if RESUMES:
        for m in range(M):
            memory[m] = z[i * M + m, j]


def finish_storey():
    if LEAVES_STATE:
        output.final_displacement[g, o] = u[i, j]
        output.final_velocity[g, o] = v[i, j]
        if not EXPLICIT_LUMPED:
            for m in range(M):
                output.final_memory[g * M + m, o] = z[i * M + m, j]


def finish_spring():
    if LEAVES_STATE:
        for m in range(M):
            output.final_memory[i * M + m, o] = z[i * M + m, j]
