"""Parts of the study stability: oscillators, failures and figures."""
