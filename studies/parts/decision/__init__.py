"""Parts of the study decision: errors of fragility medians, their cost, and the figure."""
