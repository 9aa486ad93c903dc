"""Kernels beside those of histories: response spectra, sampling, frequencies, single storeys."""
