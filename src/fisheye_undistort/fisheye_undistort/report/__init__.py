"""How far a calibrated lens is known, in words, files and plots: begin with `certainty`."""
