"""What each effect would do to the frequencies of a board, and what of it the fitted constants leave to be seen."""
