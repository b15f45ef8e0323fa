"""spinepipe: how stiff spinal joints are, how sure that is, and which physics is missing."""

__version__ = "0.1.0"
