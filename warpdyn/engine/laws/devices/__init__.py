"""Dampers and stops (class `Device`), which act in parallel with the law of a storey."""
