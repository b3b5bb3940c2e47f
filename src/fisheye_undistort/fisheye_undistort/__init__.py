"""Lens calibration from circle grids and the correction of fisheye distortion."""
