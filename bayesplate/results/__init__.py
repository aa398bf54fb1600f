"""What a fit found, as types: the summary is a projection of the draws, and every table one of the summary.

`contract` has the parts of all results; `summary` is that of a fit, made by `summarise`, with its `modes`, its `budget`
of uncertainty and its `references`. `methods` and their `comparison` are for several methods side by side, `checking`
is for what no draw was needed for, `sheets` are for the modes of a board. The draws are an `archive` of ArviZ. `tables`
are rendered by medium, on the terminal by `layout`; `fit_tables` and `command_tables` are what commands print, in
`words`. A `folder` holds the files of a run.
"""
