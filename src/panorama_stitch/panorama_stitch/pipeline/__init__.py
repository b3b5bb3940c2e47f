"""Frames -> pair -> compose -> publish.

Begin with `stitch_pipeline`, the recipe. `pairing` finds frames taken at the same time, `stale` goes
on without a silent camera, `compositor_builder` measures and prepares in the background; `metrics`
are what the pipeline reports.
"""
