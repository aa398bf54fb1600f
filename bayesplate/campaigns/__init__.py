"""What several boards share: given it the boards are independent, so each is solved once and alone.

shared      what is shared, and which columns of each board it sets
given       the density of a board where what is shared is given
marginal    that density integrated over everything that is the board's own, at nodes of what is shared
space       where the nodes stand
together    the boards' marginal likelihoods multiplied, all of them or all but one
boards      each board's own posterior under what all teach
agreement   whether a board wants what the others teach
common      what is left over on all boards alike, mode by mode
population  the distribution that the boards' constants come from
"""
