"""Figures of sensitivity analyses, state-dependent fragility and vector intensity measures."""
