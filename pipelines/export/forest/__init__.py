"""Regression forests as graphs in the ONNX format, of standard operators alone."""
