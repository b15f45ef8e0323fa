"""Numbers of papers as rows of data, and what sets them beside the tables of a run.

Not installed with spinepipe, of which nothing is imported here: what a run made is read from its
tables, whose columns are a contract. The way in is `papers.engine.compare`.
"""
