"""Hits, taps and sweeps to frequencies with their uncertainty.

Files. `reading` takes `sound`, CSV `tables` and `uff` to `signals`, which `checks` may refuse; `padding` is undone.

Decays. `hits`, by their force or their `onsets`, or `sweeps` as if one hit; `taking` makes `spectra` of them.

Modes. A `local_fit` in each window, `modes_found` in all, with their `strength`, their `plausibility`, and the
`agreement` of records; those that differ are averaged `across`. `picking` is the whole, and `contract` its result.

Labels. `patterns` of residues between places, and pictures of `sand`.
"""
