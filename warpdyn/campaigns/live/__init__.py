"""Live ensembles: histories that advance while the ground motion arrives, packet by packet."""
