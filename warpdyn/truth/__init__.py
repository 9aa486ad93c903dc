"""Exact solutions as references for tests: linear systems, and shear chains of bilinear and Bouc-Wen storeys."""

from warpdyn.truth.bilinear import bilinear_chain_response
from warpdyn.truth.bouc_wen import bouc_wen_chain_response
from warpdyn.truth.linear import harmonic_response, piecewise_linear_response

__all__ = ["bilinear_chain_response", "bouc_wen_chain_response", "harmonic_response", "piecewise_linear_response"]
