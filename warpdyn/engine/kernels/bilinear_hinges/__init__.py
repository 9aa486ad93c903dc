"""Parts of kernels for frames and fish-bones with bilinear hinges, whose branches are found in each solution."""
