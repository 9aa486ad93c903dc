"""Reports of runs: one HTML file with tables, figures and provenance, and text summaries of a few lines."""
