"""State that must last: allocation table, inventory, labels, in one database."""
