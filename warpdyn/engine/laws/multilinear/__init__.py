"""Storeys with several corners and kinematic hardening."""
