"""Scenes whose random parameters and random motions follow from given standard normal values."""
