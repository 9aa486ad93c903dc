"""What every room uses: checks, progress, threads, random numbers, units, output variables, files."""
