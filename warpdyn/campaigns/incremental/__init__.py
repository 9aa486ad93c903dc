"""Incremental dynamic analysis: the intensity at which each limit is first passed, of every structure and motion."""
