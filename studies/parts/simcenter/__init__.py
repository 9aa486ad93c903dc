"""The parts of the study simcenter."""
