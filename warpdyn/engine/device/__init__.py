"""Device functions that any kernel may call: processor intrinsics, exponentials, random numbers."""

import warp as wp

# Warp prints what it compiles and caches only at log level INFO, so that a terminal shows results.
# Another level is the user's own.
if wp.config.log_level == wp.LOG_INFO:
    wp.config.log_level = wp.LOG_WARNING
