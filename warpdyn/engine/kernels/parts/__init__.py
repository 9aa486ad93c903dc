"""Parts of kernels: storey laws, P-Delta, collapse, event sequences, and the division of samples among threads."""
