"""What the stability study is made of: its oscillators, failures and figures."""
