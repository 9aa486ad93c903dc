"""Exact solutions that warpdyn is held to: linear systems, bilinear and Bouc-Wen chains."""
