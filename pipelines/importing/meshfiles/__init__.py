"""Reads mesh files and URDFs of other programs as triangles, without taking more memory than a file can fill.

Libraries parse where they do it right (lxml, trimesh, pycollada, yourdfpy); each module says what it does not leave to
them.
"""
