"""Pages about runs for those who read results without running them: HTML files with tables, figures and provenance."""
