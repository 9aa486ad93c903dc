"""Reading and writing files: netCDF, Zarr and text files, temporary files, and tables that are part of warpdyn."""
