"""Programs for the workshop: none of them is part of the wheel."""
