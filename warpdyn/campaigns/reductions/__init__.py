"""Statistics of a run: samples are counted and added up block by block, and the samples themselves are not kept."""
