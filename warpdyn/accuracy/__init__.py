"""How far off a run is: error estimates, and the pilot that chooses method and step."""
