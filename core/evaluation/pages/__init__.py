"""What is shown of it: pictures, charts, pages."""
