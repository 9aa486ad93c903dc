"""NumPy functions of the parameters of structures, recorded once and compiled for a device."""
