"""From constants and sizes to the frequencies of a setup, and to the errors of its readings.

Frequencies. A `system` is a setup with its effects; `fabric` joins properties that several of them vary, and the
weights of its `terms` follow from constants and sizes. The `model` of a setup holds its plate and two `laws`, the
linear one (the paper's `columns` a, b, c) and the exact one; a `predictor` is ln f of all modes of a board with its
tangent. `prior_bands` are the frequencies that a prior foretells.

Readings. `reading_errors` are noise, own error and rounding in one. `labels` are refused where no mode has them, a
`spectrum` says where they contradict the modes, `peaks` without a label have a likelihood by `assignment`, and
`residues` tell signs.
"""
