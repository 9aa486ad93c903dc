"""Inventories of buildings: readers of files and tables, and the portfolios that they make."""

from warpdyn.inventories.openquake import read_openquake
from warpdyn.inventories.r2d import read_geojson, read_r2d
from warpdyn.inventories.rules import HazusRule
from warpdyn.inventories.stock import BuildingStock, portfolio
from warpdyn.inventories.table import from_table

__all__ = ["BuildingStock", "HazusRule", "from_table", "portfolio", "read_geojson", "read_openquake", "read_r2d"]
