"""Record NumPy functions of the parameters of structures once, so that kernels can compute them on a device."""

from warpdyn.engine.tracing import numpy_functions as numpy_functions  # fills the table of functions
