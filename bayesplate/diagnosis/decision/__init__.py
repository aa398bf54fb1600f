"""From probabilities to a verdict, to the model that it asks for, and to the next measurement."""
