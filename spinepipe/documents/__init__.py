"""Files that people write: how large, how deep, which characters and names, and what they say.

Each limit is asked before what it bounds is done, so that no file holds a reader up
(docs/decisions/0033).
"""
