"""The report of a study: one HTML file with findings, figures, tables and a 3-D view."""
