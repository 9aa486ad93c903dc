"""Several runs as one: what their samples are of, and one dataset of all."""
