"""Pictures to panorama.

`build` is the recipe, `posing` gives it the views of a rig. In the order in which to read: `view`
(one camera's pictures), `placing` (the surface around the rig) and `placed` (where each camera
shows anything on it), `layout` and `crop` (which columns are whose), `seam` (where neighbours
agree best), `fade` and `blend` (how they meet there), `disparity` and `flow` (how near things
meet, too), `blends` (the table of these ways), `brightness` and `gain` (how they become equally
bright), `compositor` (all of it, frame after frame). `mask` tells where a camera sees the robot
itself.

A view for a detector is drawn beside it: `virtual_camera` (where it looks), `shares` (which camera
shows which of its pixels), `virtual_parts` and `virtual_view` (how they are drawn and blended).
"""
