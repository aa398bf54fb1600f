"""From the residual of a fit to the effect that may cause it, in four steps; a module imports only earlier ones.

Shifts. The fit without a further effect (`baseline`), and what each effect would do to its frequencies: an effect has
`forms`, each with a law (`laws`), which gives its `signatures` and its `shifts` over all sizes.

Evidence. Normal `terms` at each level of noise sum to the evidence of `hypotheses`, and the `search` computes their
probabilities. `draws` and `peaks` belong to each hypothesis; `joint` solves pairs of effects together. `sensitivity`
varies the assumptions, `folds` leave one mode out, `null_control` repeats the search on simulated readings. `known`
computes effects of known size without a search, and `known_words` tells them.

Decisions. The `sizes`, the `verdict`, the `claim` that an error is reduced, the same claim for `stated` effects, and
wrong `readings`.

Results. `findings` make the `result`, with an entry of each candidate (`entries`), in `words` and `tables`.
"""
