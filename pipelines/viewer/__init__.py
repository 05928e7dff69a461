"""A page in the browser that shows what the on-line system sees; the only importer of the viewer library."""
