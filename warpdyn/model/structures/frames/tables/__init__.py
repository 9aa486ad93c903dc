"""Tables of frames from dictionaries, pandas and CSV files, and their checks."""
