"""What takes energy out of a motion in proportion to some velocity: one part of the kernels each."""
