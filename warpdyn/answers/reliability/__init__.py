"""Probabilities of rare events: subset simulation and importance sampling of limit-state functions and scenes."""
