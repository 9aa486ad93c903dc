"""Plane frames: nodes, members and sections as tables; static and modal analysis, and reduced structures for runs."""
