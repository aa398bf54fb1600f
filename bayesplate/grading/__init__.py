"""Many fitted boards: their rows, figures of makers, limits that they meet, partners that match them."""
