"""What is integrated: a structure, its excitation, what is random about it, and what is recorded."""
