"""Intensity measures of ground motions: their values, names, units and levels."""
