"""Modules of the study benchmark: cases, other programs (peers), timings, report and figure."""
