"""Skeletons of kernels: functions with the time loop, in which slots mark the lines for statements of kernel parts."""
