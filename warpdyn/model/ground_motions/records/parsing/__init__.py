"""What readers of record files share: archives, encodings, values of fixed width, and checks against headers."""
