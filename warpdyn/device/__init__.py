"""Device functions that any kernel may call: processor intrinsics, exponentials, random numbers."""

import warp as wp

# A study's terminal is for its results; what warp compiles and caches is told by its log at INFO.
wp.config.log_level = wp.LOG_WARNING
