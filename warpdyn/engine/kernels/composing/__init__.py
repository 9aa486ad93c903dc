"""Check the parts of a kernel, and write its source from a skeleton and the parts."""
