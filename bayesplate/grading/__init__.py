"""Many fitted boards: rows, makers' figures, limits of a specification, pairs of boards that match.

`boards` are the rows, `figures` those of makers, `matching` finds pairs and limits; `storage` is the journal and the
table of a batch, and `tables` are for people.
"""
