"""What is estimated without sampling, and the paper's methods for comparison.

The paper. Its `coefficients` a, b, c from three sources, its least squares (`paper`) and its `percentile` method.

The estimate. `least_squares` of relative errors, and a `refit` under any law; `identifiability` says what the readings
determine, `leave_one_out` how far each mode is missed by a fit of the others. For peaks without a label there is a
`wide_search` of the whole prior, and `labelling` names those of which one mode is likely.

Warnings. Mistakes that make all frequencies wrong (`plausibility`), `unusual` constants, and `undeclared_air`.

Drawing. A `sheet` has the lowest modes of a setup, with their shapes.
"""
