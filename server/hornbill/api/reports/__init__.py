"""Reports of jobs as CSV, JSON, JUnit XML and a page to print."""
