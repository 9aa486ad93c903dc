"""Parts of the study benchmark: cases, peers, timings, report and figure."""
