"""Hits, taps and sweeps to frequencies with their uncertainty.

Read it from `signals` (what a file holds) over `reading`, `hits` and `spectra` (of what rings down) to `local_fit` and
`modes_found` (modes in windows of frequencies) and `picking`, which puts everything together.
"""
