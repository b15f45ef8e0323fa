"""Pages over studies: the index of all of them, and two side by side."""
