"""Files: netCDF and Zarr, written under a temporary name or block after block, and tables that warpdyn contains."""
