"""The posterior of a board's constants: its density, where it lies, its draws, and what they say of the readings.

The density. `parameters` are what is sampled; the `target` is prior times likelihood.

Where it lies. `posing` leads from a board to its posterior: `first_labels` for peaks that have none, the mode and a
normal approximation (`laplace`; under Student's errors from a `robust` start), and doubts about readings: `slips` of
the pen, and `veerings`, near which a label may be another mode's.

The draws. `inference` is the whole. The `ensembles` of emcee begin at `starts` far apart, in coordinates that shorten
long `tails`, with `moves` that propose from a `mixture` fitted to the posterior; `sampling` lets them walk until the
gate of `convergence` passes, by the `statistics` of ArviZ, and keeps a `checkpoint`. A `surrogate` stands in for the
exact law, and `reweighting` corrects draws of one law to another.

What they say. `draws` by name, `likely_labels` of peaks, and the `assessment` of errors and leverages.
"""
