"""Planning of measurements: the expected gain and the cost of each further reading."""
