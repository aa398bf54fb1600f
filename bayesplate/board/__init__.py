"""What lies on the bench, in SI units: the board, its setups and readings, its prior, and the cards that state them.

Numbers. A `quantity` is a number with its `density`; a `random_field` is one that was read at places; `repeated`
readings are checked, and `stated` values come from Python.

The board. It has `inputs`, each a `parameter`, a `material`, what is `attached` to it, and one `setup` or several, each
`reading` with or without a label, some in `sessions`. `checks` say what is physically wrong; `unstatable` is what no
card states.

Cards. `toml` files stand on the `shelf`. A `schema` of keys (`board_keys`, `setup_keys`, `prior_keys`) reads `values`
and `measures` in their `units`, and `writing` writes them again; `words` serve all messages. A card is that of a
`board`, a `prior`, a table of `coefficients` or a `campaign`; `named` are those that a board card names, a `fragment`
is a setup alone, a `starter` a first card, and `rows` of a `csv_table` are many.
"""
