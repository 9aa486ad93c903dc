"""Annual losses of single buildings of an inventory."""
