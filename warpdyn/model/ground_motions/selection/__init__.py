"""Selection of records for a target spectrum: targets, spectra of records, and the selection."""
