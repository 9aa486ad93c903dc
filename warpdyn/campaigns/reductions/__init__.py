"""Statistics of a run that are named before it: samples are counted and added up, block by block."""
