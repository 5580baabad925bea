"""What was built and traced, and is kept for the panels."""
