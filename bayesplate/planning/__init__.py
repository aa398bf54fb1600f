"""Planning of measurements: the expected gain and the cost of each further reading.

`beliefs` are what is known of one board, of the boards of a `campaign`, or of the explanations that a search left
(`explained`). `stations` are ways to hold the board, `laws` how their modes change with the constants; `modes_read` and
`sizes_read` are what could be read there. `gains` are what readings are expected to give, and `proposals` ranks them.
`bench` makes the `plan` and says where sensor and hammer go; `tables` puts a plan into words.
"""
