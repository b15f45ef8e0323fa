"""spinepipe: how stiff intervertebral joints are, how sure that is, and which physics is missing."""

__version__ = "0.1.0"
