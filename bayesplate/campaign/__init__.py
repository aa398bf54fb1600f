"""Parameters that several boards share: given these the boards are independent, so that each is solved once and alone.

One board. `shared` parameters set columns of each board; `conditional` is its density given them. `likelihood` is its
likelihood of them, all of its own integrated out, by its `evidence`; a `normal_likelihood` is the same as a normal one,
and `scatter` lets them differ between boards.

All boards. Their likelihoods `combined`; `boards` are each alone and under what the others teach; `learning` is the
posterior of what they share, `population` the distribution of their constants.

A shared cause. `common` residuals, the `search` for effects that all boards share, the `claim`, by boards left out.
`summary`, `diagnosis` and `tables` hold the results.
"""
