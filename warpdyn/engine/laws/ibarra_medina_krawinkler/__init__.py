"""Storeys with a capping point and cyclic deterioration (Ibarra, Medina and Krawinkler)."""
