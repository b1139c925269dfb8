"""Pages served on this machine only: a run or an ensemble to watch, a case to edit."""
