"""Functions that any kernel may call: extrema, exponentials, random numbers, access to neighbouring threads."""

import warp as wp

# At log level INFO, Warp prints a line for each module that it loads. Show warnings only, unless the user has chosen
# another level.
if wp.config.log_level == wp.LOG_INFO:
    wp.config.log_level = wp.LOG_WARNING
