"""From constants and sizes to the frequencies of a setup, and to the errors of its readings.

Frequencies. A `system` is a setup with its effects: its plate, and the weights of its `terms`, which follow from
constants and sizes; where several effects vary one property, `fabric` multiplies their fields. A `model` solves the
plate once, finds the labelled modes, and has two `laws` for omega^2: the linear one, by the energies of these modes,
and the exact one, by eigenvalues of a reduced plate. `columns` are the paper's a, b, c. A `predictor` is ln f of all
modes with its slopes, `prior_bands` the range of each frequency before anything is measured.

Readings. The likelihood of a labelled reading, with its noise, own error and rounding, is in `reading_errors`; that of
`peaks` without a label is summed over every `assignment` to modes. `labels` finds those that no mode can have,
`spectrum` those that contradict the computed modes; `residues` say how strongly a mode responds, and with which sign.
"""
