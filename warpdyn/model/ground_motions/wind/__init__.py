"""Wind: spectra of turbulence, random wind forces on the floors of a building, and stripes of force levels."""
