"""From the residual of a fit to the effect that may cause it, in four steps; none imports a later one.

Shifts. `baseline` is the fit without a further effect. What an effect would do to the frequencies: it has `forms`, each
with a law (`laws`); `signatures` are its shifts at a usual size, `shifts` those at all sizes.

Evidence. Normal `terms`, one for each size and level of noise, sum to the evidence of `hypotheses`, and `search`
computes their probabilities. Each hypothesis has `draws`, and labels of its own for `peaks`; `joint` solves pairs of
effects together. `sensitivity` varies the assumptions, `folds` leave one mode out, `null_control` repeats the search on
simulated readings. `known` computes effects of known size without a search.

Decisions. `sizes`, the `verdict`, the `claim` that an error is reduced by an effect that was found, the same claim for
effects that the card states (`stated`), and wrong `readings`.

Results. `findings` make the `result`, with an entry of each candidate (`entries`), in `words`, `known_words` and
`tables`.
"""
