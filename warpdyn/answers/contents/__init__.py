"""Contents and components of buildings: rigid blocks on floors, and fragility and losses of components by storey."""
