"""From the residual of a fit to the effect that may be behind it, in four steps; a file sees those of the steps before.

The fit that is questioned (`baseline`), and what each effect would do to its frequencies: an effect has `forms`, each
with a law (`laws`), from which come its `signatures` and the `shifts` over all its sizes.

How probable the readings are: `terms` at each level of noise make the evidence of `hypotheses`, the `search` weighs
these; `draws` and `peaks` under each, `joint` solutions of pairs, the `sensitivity` to what was assumed, `folds`
without one mode, the `null_control`; beside it what is `known` without a search.

What is decided: the `sizes`, the `verdict`, the `claim` that an error is reduced, that of what is `stated`, `readings`
that are wrong.

What is told: `findings` make the `result` of it, with its candidates' `entries`, in `words` and `tables`.
"""
