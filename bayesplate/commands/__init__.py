"""The public functions, one file for each, and what they have in common; the command line calls the same functions.

Functions. `fit`, `diagnose`, `compare`, `check`, `plan`, `modes`, `cite`, `pick`, `batch`, `new`, and `fit_board`, a
fit that neither reads nor writes files, so that any process may compute it.

In common. `arguments` and `options` read what was given; `prepare` reads the card and everything it names; a `problem`,
or the `campaign` of several boards, is what is sampled. `printout` is what any command prints.

A fit. `fitting` computes one, with its files; `campaign_fit` and `campaign_diagnose` are those of several boards.

A batch. `batch_boards` lists its boards, `batch_run` fits them on `workers`, `batch_grading` reads how to grade them.

Picking. `pick_options` are its own arguments; `pick_labels` labels the peaks, by the likelihood of the modes to which
they are `assigned`; `pick_words` is what it prints, and `fragment` writes the [setup] that a card takes.
"""
