"""The text of a kernel: how it is put together from a skeleton and parts, and what is checked before."""
