"""What lies on the bench, in SI units: the board, its setups and readings, its prior, and the cards that state them.

The board. `board` is its class: what the card states of it (`inputs` and `material`), what is `attached` to it, the
fluid around it, and its setups. A `setup` is one way to hold it, with a `reading` for each frequency, labelled or not;
`sessions` are setups that hold it alike. An uncertain number is a `parameter`. `checks` find physical faults.

Numbers. A `quantity` is a number with its uncertainty, whose form is a `density`; `repeated` readings make one, and a
`random_field` is a thickness or a width that was read at places.

Cards. A card is a `toml` file, found by its path or on the `shelf` of shipped cards, and validated by a `schema`. Its
keys stand in `board_keys`, `setup_keys` and `prior_keys`; `values` and `measures` read each of them into SI `units`,
and `writing` writes it again. `words` are those that a card may use, and how messages show a wrong one.

Kinds of cards. That of a board is read in `board`; it may name a `prior` and tables of `coefficients`, which `named`
loads. A `campaign` card names boards. A `fragment` is a [setup] in a file of its own, a `starter` is the text of a
first card, and `rows` are many boards in a `csv_table`.

Python. `stated` reads the values that Python states instead of a card; `unstatable` finds what no card could state.
"""
