"""Pictures of a sphere with one distribution put in the place of another."""
