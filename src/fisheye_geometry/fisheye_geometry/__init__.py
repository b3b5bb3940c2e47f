"""Fisheye lenses, projection surfaces and the remap tables between them."""
