"""Synthetic ground motions: stochastic motions from an earthquake scenario, and velocity pulses."""
