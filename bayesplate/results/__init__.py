"""What a command found, as types, tables and files; the summary of a fit is computed from its draws and nothing else.

Types. `summary` is that of a fit, made by `summarise`, with its `modes`, the `budget` of its uncertainty and its
`references`; `comparison` is that of several `methods`, `checking` that of a check, `sheets` the lowest modes.
`contract` has the parts that all of them use. An `archive` holds the draws, for ArviZ.

Tables. `tables` renders one for terminal, page, CSV or LaTeX, and `layout` fits it to a terminal; `fit_tables` and
`command_tables` are those that commands print, in the `words` of all results.

Files. A `folder` holds those of a run.
"""
