"""Figures by forms: a kind of study selects rows and names axes, a form draws them."""
