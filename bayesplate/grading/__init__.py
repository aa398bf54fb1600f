"""Many fitted boards: table rows, makers' figures, limits of a specification, pairs of matching boards."""
