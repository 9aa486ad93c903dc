"""Ensembles of structural dynamics, integrated in parallel on GPUs and CPUs.

`__init__.pyi` lists the public names with their modules. A module is imported when one of its names is first used (PEP
562), so that `import warpdyn` is fast and does not import Warp.

Example:
    The examples of all public names continue this example. A building with two storeys and random strength, under
    eight motions that are scaled to six levels:

    >>> import numpy as np
    >>> import pandas as pd
    >>> import warpdyn as wd
    >>> law = wd.laws.Bilinear(yield_force=[3e5, 2e5], hardening_ratio=0.05)  # N
    >>> damped = dict(damping="rayleigh", damping_ratio=0.05)
    >>> building = wd.ShearBuilding(mass=1e5, stiffness=[4e7, 3e7], height=3.0, law=law, **damped)  # kg, N/m, m
    >>> time, random = np.arange(0, 10, 0.02), np.random.default_rng(1)
    >>> noise = 2.5 * random.normal(size=(8, time.size)) * np.exp(-(((time - 4) / 2) ** 2))  # m/s2
    >>> motions = [wd.GroundMotion(row, 0.02, f"noise {i}") for i, row in enumerate(noise)]
    >>> stripes = wd.Stripes(motions, [0.15, 0.25, 0.4, 0.6, 0.9, 1.4], wd.PeakGroundAcceleration())  # g
    >>> scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    >>> scene = wd.Scene(building, stripes, scatter)
    >>> run = wd.simulate(scene, structures=3, seed=1)

    Its fragility curves, the hazard of its site, and three buildings of a region under the unscaled motions:

    >>> limits = {"slight": 0.005, "complete": 0.015}  # storey drift ratios
    >>> curves = wd.fragility(run, limits)
    >>> hazard = wd.HazardCurve([0.05, 0.2, 1.0, 4.0], [2e-2, 3e-3, 1e-4, 5e-7], measure="PGA")  # g, 1/year
    >>> table = pd.DataFrame({"id": ["a", "b", "c"], "longitude": [-122.3, -122.3, -122.2], "latitude": 37.8})
    >>> table[["structure_type", "storeys", "year"]] = [("W1", 2, 1990), ("W1", 2, 1930), ("C1L", 2, 1990)]
    >>> inventory = wd.inventories.from_table(table.assign(replacement_cost=[3e5, 2e5, 4e6]))
    >>> stock = wd.inventories.portfolio(inventory)
    >>> region = wd.Scene(stock.portfolio, wd.Cloud(motions), recorders=("drift",))
    >>> counted = wd.simulate(region, statistics=wd.DamageCounts(stock.limits, over="building"))
    >>> results = wd.building_results(counted, stock, inventory, wd.hazus_loss_ratios("RES1"))

    A portal frame of two columns and a beam:

    >>> nodes = {"A": (0.0, 0.0), "B": (0.0, 4.0), "C": (6.0, 4.0), "D": (6.0, 0.0)}  # x, y [m]
    >>> members = {"left": ("A", "B", "column"), "beam": ("B", "C", "beam"), "right": ("D", "C", "column")}
    >>> steel = {"elastic_modulus": 2e11, "area": 0.012}  # Pa, m2
    >>> sections = {"column": steel | {"second_moment": 1.49e-4}, "beam": steel | {"second_moment": 2.31e-4}}  # m4
    >>> floor = dict(diaphragms={"floor": ["B", "C"]}, masses={"floor": 70e3})  # kg
    >>> portal = wd.Frame(nodes, members, sections, supports={"A": "fixed", "D": "fixed"}, **floor)
"""

import lazy_loader

__version__ = "0.2.0"  # pyproject.toml reads it from here

_named, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    """Return a public name; the error for a misspelt name suggests the correct one."""
    if name in __all__ or name.startswith("_"):
        return _named(name)
    from warpdyn.foundations.core.near_misses import did_you_mean

    raise AttributeError(f"warpdyn has no {name!r}{did_you_mean(name, __all__)}; dir(warpdyn) lists its names")
