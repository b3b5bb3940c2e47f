"""The panorama for people: live in a browser, or saved to a file.

Begin with `viewer_node`, which takes what the rig publishes, and `server`, the thread that hands
it to browsers. `gate` and `connection` bound who is connected, `guard` and `token` who may do
what, `tls` encrypts, `site` answers, `audience` has the places, `browser` serves one of
them what `feeds` makes of each picture, as often as `pace` finds that its link takes one; the page
is in `web/`. The command `snapshot` is `snapshot_node`; its files are made by `snapshot`, those
of photo spheres by `photo_sphere`.
"""
