"""What a dataset holds, and reading it back episode by episode."""
