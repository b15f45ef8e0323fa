"""Mutation testing: small faults put into the library, and whether a test sees them."""
