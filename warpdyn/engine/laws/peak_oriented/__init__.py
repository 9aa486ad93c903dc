"""Peak-oriented storeys: Clough's law and Takeda's."""
