"""How scenes are run: integration, accuracy, runs in blocks and regions, incremental dynamic analysis, reductions."""
