"""Matrices of shear chains, written down apart from warpdyn's own."""

import numpy as np
from scipy.linalg import eigh


def chain_matrix(storeys):
    """Return the stiffness matrix of a chain from those of its storeys, or a damping matrix from their dashpots."""
    return np.diag(storeys + np.append(storeys[1:], 0)) - np.diag(storeys[1:], 1) - np.diag(storeys[1:], -1)


def modal_damping_matrix(mass, stiffness, ratio):
    """Return the damping matrix with which every mode of a stiffness matrix and masses has one damping ratio."""
    squares, shapes = eigh(stiffness, np.diag(mass))
    momenta = np.diag(mass) @ shapes
    return momenta @ np.diag(2 * ratio * np.sqrt(squares)) @ momenta.T
