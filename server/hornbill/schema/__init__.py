"""The tables as values: parameters, models, fault bits, effect rules. Knows nothing of bytes."""
