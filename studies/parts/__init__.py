"""What the studies import: a folder a study, and the command line that they share."""
