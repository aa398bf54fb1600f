"""An independent generator of boards: another discretisation, other formulations, planted effects, cards to read.

It knows nothing of the package. Read it from `plate` (a rectangular plate) over `effects` (what a real one has besides)
to `boards` (boards with planted effects, and their cards).
"""
