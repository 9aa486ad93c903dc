"""What the decision study is made of: the errors of fragility medians and their cost, and its figure."""
