"""Many fitted boards side by side: makers' figures, limits of a specification, pairs that match.

`boards` are the rows, `figures` what makers compute from constants, `matching` finds boards within limits and pairs;
`storage` keeps the journal and the table of a batch, and `tables` are what people read.
"""
