"""Recorders, such as peak drifts: each file contains the statements of a recorder and its output variables."""
