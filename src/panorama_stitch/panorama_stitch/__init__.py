"""Overlap calibration and live stitching of fisheye cameras to one panorama."""
