"""The bus doctor: what is wrong with the bus, from what was heard and counted anyway; it sends nothing."""
