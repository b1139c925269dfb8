"""One page of a run or of an ensemble, in one file that loads nothing from outside."""
