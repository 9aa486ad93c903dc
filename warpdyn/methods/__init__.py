"""Integration methods: their tables, kinds, amplification and stability limits."""
