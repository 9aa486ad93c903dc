"""What is kept of a run: one file for each recorder, with its part of the kernels and its variables."""
