"""Kernels for other tasks than response histories: response spectra, sampling, frequencies, single storeys."""
