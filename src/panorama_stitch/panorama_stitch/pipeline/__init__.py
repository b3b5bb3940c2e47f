"""Frames -> pair -> compose -> publish.

Begin with `stitch_pipeline`, the recipe. `pairing` finds frames taken at the same time, `stale`
keeps what silent cameras showed last, `economy` leaves out what there is no time for, `rig_state`
is what is known of the cameras, and `compositor_builder` measures and prepares in the background;
`metrics` are what is reported.
"""
