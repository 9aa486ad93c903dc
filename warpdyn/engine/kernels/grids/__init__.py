"""Frames with hinges whose joints are a grid of floors and column lines: a thread of a GPU computes a storey."""
