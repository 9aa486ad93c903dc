"""Parts of kernels for controlled structures: sensors, controllers and actuators."""
