"""What is estimated before any sampling, and the paper's methods for comparison.

The paper. `coefficients` a, b, c from three sources, its least squares (`paper`) and its `percentile` method.

The start. `least_squares` in relative terms, `leave_one_out` errors, `identifiability`, a `refit` under any law, and a
`wide_search` where peaks have no label; `labelling` gives them one where it is likely.

Warnings. `plausibility` of all frequencies together, `unusual` boards, `undeclared_air`. A `sheet` has the lowest
modes, to draw.
"""
