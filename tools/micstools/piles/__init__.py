"""Numbers of piles, of one run and of an ensemble."""
