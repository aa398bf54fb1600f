"""Parameters that several boards share: given these the boards are independent, so that each is solved once and alone.

shared      the shared parameters, and the columns of each board that they set
given       the density of a board, given the shared parameters
likelihood  a board's likelihood of the shared parameters, all of its own integrated out, from draws
evidence    the probability of a board's readings
pulls       a board's likelihood of the shared parameters, as a normal one
scatter     shared parameters that differ between boards
together    the product of the boards' likelihoods, of all of them or of all but one
boards      each board's draws, alone and under what the others teach
learning    the posterior of the shared parameters from boards that were fitted alone
claim       whether a board agrees with the others, and whether a shared effect may be claimed
search      the probability of effects that all boards share
common      residuals of each mode that all boards have in common
population  the distribution of the boards' constants
"""
