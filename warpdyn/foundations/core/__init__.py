"""Modules that every package uses: checks, messages, progress, threads, random numbers, units, output variables."""
