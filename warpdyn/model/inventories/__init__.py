"""Inventories of buildings: readers of files and tables, and portfolios made from inventories."""

from warpdyn.model.inventories.openquake import read_openquake
from warpdyn.model.inventories.r2d import read_geojson, read_r2d
from warpdyn.model.inventories.rules import HazusRule
from warpdyn.model.inventories.stock import BuildingStock, portfolio
from warpdyn.model.inventories.table import from_table

__all__ = ["BuildingStock", "HazusRule", "from_table", "portfolio", "read_geojson", "read_openquake", "read_r2d"]
