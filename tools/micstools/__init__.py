"""Read, check and draw the results of mics."""
