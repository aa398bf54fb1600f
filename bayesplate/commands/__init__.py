"""One file for each command; the command line and the functions of the package call these.

Commands. `fit`, `diagnose`, `compare`, `check`, `plan`, `modes`, `cite`, `pick`, `batch` and `new`.

Before. `arguments` and `options` read what was given; `prepare` reads the card and everything it names; a `problem`, or
a `campaign`, is what is sampled.

A fit. `fitting` is one fit in a run, `fit_board` the same as a pure function, `campaign_fit` and `campaign_diagnose`
are those of several boards. `printout` is what any command prints.

A batch. `batch_boards` are listed, `batch_run` fits them on `workers`, `batch_grading` is what is asked of them.

Picking. `pick_options`, `pick_labels` by likelihood, `assigned` peaks, `pick_words`, and the `fragment` of a card.
"""
