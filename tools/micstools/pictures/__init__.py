"""Diagrams, pictures, films and exports of a run."""
