"""Policies as ONNX files that run without vinl, and homes as MJCF to try them in."""
