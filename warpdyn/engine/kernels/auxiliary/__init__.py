"""Kernels that do not integrate histories: response spectra, sampling, frequencies, single storeys."""
