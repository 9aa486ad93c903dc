"""What every other layer builds on: checks, messages, progress, and files."""
