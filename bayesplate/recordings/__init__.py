"""Hits, taps and sweeps to frequencies with their uncertainty.

Read it from `signals` (what a file holds) over `reading`, `hits` and `decays` (the spectra of what rings down) to
`greedy` and `local_fit` (modes in a window of frequencies) and `picking`, which puts everything together.
"""
