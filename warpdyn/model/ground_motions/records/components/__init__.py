"""Components of a record: labels of directions, labels in file names, and pairs of horizontal components."""
