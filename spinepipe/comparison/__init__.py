"""Published numbers beside those of a run; the numbers themselves lie in the folder `papers`."""
