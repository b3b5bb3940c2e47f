"""Between ROS 2 and arrays: images, camera_info, parameters, QoS, diagnostics, running."""
