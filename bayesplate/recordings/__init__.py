"""Hits, taps and sweeps to frequencies with their uncertainty.

Read it from `signals` (the recordings of a file) over `reading`, `hits` and `spectra` (of decays) to `local_fit` and
`modes_found` (modes in windows of frequencies) and `picking`, which puts everything together.
"""
