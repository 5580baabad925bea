"""The contract of a structure: what every one promises, counts, logs and gives to draw."""
