"""Incremental dynamic analysis: the intensity at which each structure under each motion first exceeds each limit."""
