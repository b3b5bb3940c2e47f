"""Calibration of fisheye lenses, and the correction of their distortion.

`calibrate_lens` goes through the rooms in this order: `target` (what is printed), `detect` (views
of it in pictures), `fit` (the lens), `report` (how far it is known); `foreign` reads and writes
the calibrations of other programs. `undistort_node` corrects pictures, by `correction`.
"""
