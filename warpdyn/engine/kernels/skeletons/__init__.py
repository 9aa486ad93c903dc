"""Skeletons of kernels: functions with the time loop, in which slots mark the places for statements of parts."""
