"""Wood-frame shear walls (Folz and Filiatrault 2001; OpenSees: SAWS)."""
