"""Laws whose device functions are written in the class body."""
