"""Controllers: classes with parameters and a device function that returns the command of an actuator."""
