"""Planning of measurements: the expected gain and the cost of each further reading.

`beliefs` are about one board, about a `campaign`, or about explanations after a search (`explained`). `stations` are
ways to hold the board, with the `laws` of their modes; `modes_read` and `sizes_read` are what could be read there.
`gains` follow, and `proposals`, the best first; `bench` makes the `plan` and the work at the bench, and `tables` are
its words.
"""
