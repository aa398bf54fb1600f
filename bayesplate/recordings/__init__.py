"""Hits, taps and sweeps to frequencies with their uncertainty.

Files. `reading` reads `sound`, CSV `tables` and `uff` files into `signals`, and `checks` refuse what cannot be used.

Spectra. `hits` are found in the force, or in the `onsets` of the sound; `sweeps` become impulse responses, which
count as hits. `taking` makes `spectra` of their decays; zeros that were added to a record (`padding`) are undone.

Modes. `picking` is the whole: a `local_fit` in each window gives the `modes_found`, each with its `strength` and the
`plausibility` that it is one. The `agreement` of records is tested; modes of those that differ are averaged `across`.

Labels. `patterns` of residues between places, and pictures of `sand`, are evidence for labels.

Result. `contract` is what the command returns.
"""
