"""Parameters that several boards share: given these the boards are independent, so that each is solved once and alone.

One board. A `shared` parameter sets columns of each board; `conditional` is the density of one board given all of them.
Its `likelihood` of them, all of its own integrated out, comes from its draws and their `evidence`; `normal_likelihood`
is the normal approximation, and `scatter` lets the shared numbers differ from board to board. `boards` has each board
alone, and under what the others teach.

All boards. `combined` is the product of the boards' likelihoods, `learning` the posterior of what they share, and
`population` the distribution of their constants.

A shared cause. `common` pools the residuals of each mode over the boards, `search` looks for effects that all of them
share, and `claim` judges these by boards left out.

Results. `summary`, `diagnosis` and `tables`.
"""
