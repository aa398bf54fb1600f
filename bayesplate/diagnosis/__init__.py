"""From the residual of a fit to the effect that may be behind it."""
