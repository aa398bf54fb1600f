"""A diagnosis as one result, and what people read of it."""
