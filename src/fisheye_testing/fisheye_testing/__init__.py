"""What tests, benchmarks and the demonstration share; no package needs it to run.

Begin with `rig` (the installed executables as real processes in a ROS domain of their own) and
`watcher` (a subscriber beside them). `health` judges a running rig. `mjpeg_server` and
`network_camera` (made of `camera_encoder`, `datagram_relay`, `rtsp_camera` and `http_camera`) are
network cameras; `odd_pictures` and `image_message` construct inputs.
"""
