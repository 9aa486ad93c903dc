"""How a method takes a step: one part of the kernels each."""
