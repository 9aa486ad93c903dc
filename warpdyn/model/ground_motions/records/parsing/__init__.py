"""Functions that several readers use: archives, encodings, values of fixed width, and comparisons with headers."""
