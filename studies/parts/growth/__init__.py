"""Parts of the study growth."""
