"""Kernels for tasks other than response histories: response spectra, sampling, frequencies, single storeys."""
