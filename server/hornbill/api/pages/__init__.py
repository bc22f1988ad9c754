"""Static files of the page and the documentation."""
