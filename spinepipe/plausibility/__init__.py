"""How well numbers fit what is usual, and which mistake would bring them back."""
