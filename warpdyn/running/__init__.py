"""Runs: simulate, blocks, sinks, histories, labelled results, pushover."""
