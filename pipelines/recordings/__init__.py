"""Recorded depth: file formats, layouts of folders, joints and part labels, as frames."""
