"""Calibrate a rig from one turn on the spot: lenses, mounts and the vertical, without any sheet.

Read `turn_calibration` first: it is the recipe. `recording` reads pictures, `tracker` (with
`corners`) keeps those between which the scene moved and follows corners, `full_circle` finds where
the turn comes round, `first_turn` makes a first estimate of it all. `turn_state` is the model,
`bundle` (with `expectation`) fits it. `level_views` (with `patches`) and `landmarks` look for the
same landmarks in every picture of every camera, `halves`, `lens_angles`, `turn_certainty` and
`turn_report` tell what the result is worth, `rig_files` writes it, `calibrate_rig` is the command
and `record_node` its ear for topics.
"""
