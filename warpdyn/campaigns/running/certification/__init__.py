"""Checks of storey laws and devices, also of those that users write."""

from warpdyn.campaigns.running.certification.certify import certify

__all__ = ["certify"]
