"""What the study growth is made of."""
