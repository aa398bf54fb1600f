"""The posterior of a board's constants: its density, where it lies, its draws, and what they say of the readings.

The density. `parameters` are what is sampled, with `tails` shortened; the `target` is prior times likelihood. `posing`
leads from a board to it: `first_labels` for peaks, a `robust` start, a `laplace` approximation, a `surrogate` of the
exact law, and doubts about readings before anything is sampled (`slips`, `veerings`).

The draws. From `starts` far apart the `ensembles` of emcee walk, with the `moves` of a `mixture`; `sampling` goes on
until `convergence`, by `statistics` of ArviZ, with a `checkpoint`. `inference` is the whole, with `reweighting` from
one law to the other.

What they say. `draws` by name, `likely_labels` of peaks, and the `assessment` of errors and leverages.
"""
