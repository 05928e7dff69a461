"""Reads mesh files and URDFs of other programs as triangles, without taking more memory than a file can fill."""
