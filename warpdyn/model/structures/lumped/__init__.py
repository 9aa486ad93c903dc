"""Lumped-parameter structures: degrees of freedom connected by springs, and the formulas for their parameters."""
