"""Files of netCDF: written beside their place, moved there when complete, and grown block by block."""
