"""Where two neighbouring cameras look, measured on what both see.

`measure` is the recipe. In the order in which to read: `view` (an image and its camera model),
`features` (what can be recognised), `correspondences` (which are alike), `rotation` (which
rotations they propose), `coarse` (which else, where features are few), `strips` (the overlap that
a rotation makes), `patches` and `votes` (how each piece of it is displaced), `parallax` (the
rotation at which the far scene agrees), `trial` (all of it for one proposal), `choice` (which one
has most merit), `confidence` (how probably that is right), `result` (what limits it). `monitor`
tells from one pair of frames a second whether a rotation in use still holds.
"""
