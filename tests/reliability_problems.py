"""Reliability problems of the TNO benchmark: limit-state functions of standard normal variables, and probabilities.

The definitions are those of otbenchmark (mbaudin47/otbenchmark). The probabilities were computed by numerical
quadrature of the definitions; seven published values differ from them by 0.2 to 5 %.
"""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr

ROOT = np.sqrt(2)


def rp22(x):
    return 2.5 - (x[:, 0] + x[:, 1]) / ROOT + 0.1 * (x[:, 0] - x[:, 1]) ** 2


def four_branches(x):
    total, difference = (x[:, 0] + x[:, 1]) / ROOT, x[:, 0] - x[:, 1]
    curved = 3 + 0.1 * difference**2
    return np.min([curved - total, curved + total, 7 / ROOT + difference, 7 / ROOT - difference], axis=0)


def rp24(x):
    first, second = 10 + 3 * x[:, 0], 10 + 3 * x[:, 1]
    return 2.5 - 0.2357 * (first - second) + 0.00463 * (first + second - 20) ** 4


def rp25(x):
    return np.maximum(x[:, 0] ** 2 - 8 * x[:, 1] + 16, -16 * x[:, 0] + x[:, 1] + 32)


def rp28(x):
    return (78064 + 11710 * x[:, 0]) * (0.0104 + 0.00156 * x[:, 1]) - 146.14


def rp31(x):
    return 2 - x[:, 1] + 256 * x[:, 0] ** 4


def rp33(x):
    return np.minimum(3 * np.sqrt(3) - x.sum(axis=1), 3 - x[:, 2])


def rp35(x):
    first = 2 - x[:, 1] + np.exp(-0.1 * x[:, 0] ** 2) + (0.2 * x[:, 0]) ** 4
    return np.minimum(first, 4.5 - x[:, 0] * x[:, 1])


def rp53(x):
    first, second = 1.5 + x[:, 0], 2.5 + x[:, 1]
    return np.sin(2.5 * first) + 2 - (first**2 + 4) * (second - 1) / 20


def rp54(x):
    return -log_ndtr(-x).sum(axis=1) - 8.951  # exponential variables


def rp57(x):
    inner = np.maximum(-(x[:, 0] ** 2) + x[:, 1] ** 3 + 3, 2 - x[:, 0] - 8 * x[:, 1])
    return np.minimum(inner, (x[:, 0] + 3) ** 2 + (x[:, 1] + 3) ** 2 - 4)


def rp63(x):
    return 0.1 * (x[:, 1:] ** 2).sum(axis=1) - x[:, 0] - 4.5


def rp75(x):
    return 3 - x[:, 0] * x[:, 1]


def rp89(x):
    return np.minimum(-(x[:, 0] ** 2) - x[:, 1] + 8, -x[:, 0] / 5 - x[:, 1] + 6)


def rp107(x):
    return 5 * np.sqrt(10) - x.sum(axis=1)


def rp110(x):
    first = np.where(x[:, 0] <= 3.5, 0.85 - 0.1 * x[:, 0], 4 - x[:, 0])
    return np.minimum(first, np.where(x[:, 1] <= 2, 2.3 - x[:, 1], 0.5 - 0.1 * x[:, 1]))


def rp111(x):
    return 12.5 - np.abs(x[:, 0] * x[:, 1])


def linear(x):
    return 4.2649 - x.sum(axis=1) / np.sqrt(x.shape[1])


PROBLEMS = {  # name -> function, number of variables, probability
    "RP22": (rp22, 2, 0.00420730551),
    "four branches": (four_branches, 2, 0.00222279507),
    "RP24": (rp24, 2, 0.00285994569),
    "RP25": (rp25, 2, 4.14856629e-05),
    "RP28": (rp28, 2, 1.45308908e-07),
    "RP31": (rp31, 2, 0.00322668121),
    "RP33": (rp33, 3, 0.00257559779),
    "RP35": (rp35, 2, 0.00347894759),
    "RP53": (rp53, 2, 0.0313204867),
    "RP54": (rp54, 20, 0.000990603072),
    "RP57": (rp57, 2, 0.02823953),
    "RP63": (rp63, 100, 0.000376943612),
    "RP75": (rp75, 2, 0.00981929872),
    "RP89": (rp89, 2, 0.00547128056),
    "RP107": (rp107, 10, 2.86651572e-07),
    "RP110": (rp110, 2, 3.19578843e-05),
    "RP111": (rp111, 2, 8.03508597e-07),
    "linear, 100 variables": (linear, 100, 9.99958769e-06),
}
