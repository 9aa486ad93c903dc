"""Readers and writers for files of other programs: OpenQuake (NRML and tables), pelicun, and tables for pandas."""
