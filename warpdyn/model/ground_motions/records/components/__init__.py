"""Components of a record: labels of directions, names of files, and pairs of horizontal components."""
