"""Checks of storey laws and devices, including laws that users write."""

from warpdyn.campaigns.running.certification.certify import certify

__all__ = ["certify"]
