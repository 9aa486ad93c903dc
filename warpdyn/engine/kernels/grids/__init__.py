"""Frames with hinges whose joints are a grid of floors and column lines, and fish-bones: hinges on lines of laws."""
