"""Kernel parts of frames with hinges: massless rotations, found in each stage of the method."""
