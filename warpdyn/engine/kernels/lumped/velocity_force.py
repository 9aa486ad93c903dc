"""Laws of springs whose force or memory depends on the rate of deformation: contacts."""

from warpdyn.engine.laws.springs import spring_row

order = 10


def wanted(plan):
    return plan.pattern is not None and spring_row(plan.law).viscous_force is not None


def names(plan):
    law = spring_row(plan.law)
    memory = {} if law.memory_at_velocity is None else {"memory_at_velocity": law.memory_at_velocity}
    return {"viscous_force_of": law.viscous_force, "FOLLOWS_VELOCITY": bool(memory), **memory}


def add_velocity_force():
    f += viscous_force_of(drift, rate, memory, c)


def end_step():
    if FOLLOWS_VELOCITY:
        for i in range(SPRINGS):
            for j in range(LANES):
                slot("storey_coefficients")
                slot("accepted_memory")
                memory = memory_at_velocity(deformation[i, j], deformation_rate[i, j], memory, c)
                for m in range(M):
                    z[i * M + m, j] = memory[m]
                    if TAKES_MEMORY:
                        zs[i * M + m, j] = memory[m]
