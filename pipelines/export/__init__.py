"""Exporters: a corpus in the formats that others read, one file each."""
