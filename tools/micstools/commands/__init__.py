"""The commands of `mics-tools`, a module each: its arguments and its work."""
