"""What every package of warpdyn uses: checks, progress, threads, random numbers, units, output variables."""
