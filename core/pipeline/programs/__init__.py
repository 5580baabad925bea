"""Programs that come with AccelScope, each a file to read from top to bottom."""
