"""Studies of the product: the paper, the benchmark, the audits, the pages of the report."""
