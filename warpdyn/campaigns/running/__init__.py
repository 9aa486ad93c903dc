"""Runs of scenes: blocks, pipeline, labelled datasets, whole histories, selections, pushover."""
