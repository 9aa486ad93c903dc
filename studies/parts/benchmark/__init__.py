"""What the benchmark study is made of: its cases, peers, timings, report and figure."""
