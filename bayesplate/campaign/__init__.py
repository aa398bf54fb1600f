"""What several boards share: given it the boards are independent, so each is solved once and alone.

shared      what is shared, and which columns of each board it sets
given       the density of a board where what is shared is given
likelihood  what a board says of it, everything of its own integrated out: found from draws
evidence    the probability of a board's readings
pulls       what a board says, as a normal likelihood
together    the boards' likelihoods multiplied, all of them or all but one
boards      each board's draws, by itself and where the others are
learning    from boards alone to what they teach together
claim       whether a board wants what the others teach, and whether a shared effect may be claimed
common      what is left over on all boards alike, mode by mode
population  the distribution that the boards' constants come from
"""
