"""What a run says: its files as arrays, units, rest, energy, overlaps, health."""
