"""Statistics during a run: samples are counted and added up block by block, and are not kept."""
