"""Many buildings of different kinds at once."""
