"""Contacts between degrees of freedom: laws of springs that act in compression beyond a clearance."""
