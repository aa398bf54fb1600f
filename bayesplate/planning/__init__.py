"""What to measure next: what each further reading is expected to give, and at what cost."""
