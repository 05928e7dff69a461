"""Inspection of a corpus: contact sheets, statistics, and a page that shows both."""
