"""Calibrations of other programs, read and written: begin with `conversion`."""
