"""Checks of storey laws, dampers and stops, including those that users write."""

from warpdyn.campaigns.running.certification.certify import certify

__all__ = ["certify"]
