"""Device functions that any kernel may call: processor intrinsics, exponentials, random numbers."""
