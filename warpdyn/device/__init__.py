"""Device functions that any kernel may call: processor intrinsics, exponentials, random numbers."""

import warp as wp

# Warp prints what it compiles and caches only at log level INFO, so that a terminal shows results.
wp.config.log_level = wp.LOG_WARNING
