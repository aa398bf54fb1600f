"""How probable the readings are under each hypothesis, and how often chance alone would look like that."""
