"""What a hazard curve is read from and checked against: files, names of measures, the highest hazard known."""
