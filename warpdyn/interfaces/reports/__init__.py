"""Reports: one HTML file per run with tables, figures and provenance, and summaries of a few lines."""
