"""Modules for all packages: checks, messages, progress, threads, random numbers, units, output variables."""
