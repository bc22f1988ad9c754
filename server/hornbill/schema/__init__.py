"""The parameter tables as objects: parameters, models, fault bits, effect rules. Independent of the wire."""
