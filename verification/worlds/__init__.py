"""Worlds drawn at random, and the laws that every right answer obeys."""
