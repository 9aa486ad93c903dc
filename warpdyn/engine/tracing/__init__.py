"""NumPy functions of the parameters of structures, recorded once and compiled for a device."""

from warpdyn.engine.tracing import numpy_functions as numpy_functions  # fills the table of functions
