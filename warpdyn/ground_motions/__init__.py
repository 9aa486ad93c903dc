"""Ground motions: records and their readers, random motions, intensity measures, spectra, designs."""
