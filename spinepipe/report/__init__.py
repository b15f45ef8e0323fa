"""Figures and generated reference pages, made from the result tables and their schemas."""
