"""Fragility: curves fitted to the demands of runs, and shares of a portfolio's buildings in damage states."""
