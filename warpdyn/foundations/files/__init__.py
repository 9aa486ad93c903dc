"""Files: netCDF, written beside its place, moved there when complete, grown block by block; tables that are shipped."""
