"""The command `warpdyn`: self-test, runs of scenes from files, and reports of runs."""
