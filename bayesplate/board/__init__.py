"""Boards in SI units: the board, its setups and readings, its prior, and the cards that state them."""
