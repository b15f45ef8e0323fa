"""Projects that are wrong on purpose: everything that a user hands in, spoilt in one place each.

What a column or a key may hold is read from the documentation, as users read it; nothing here
imports the library.
"""
