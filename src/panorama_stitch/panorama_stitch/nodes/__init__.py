"""The ROS nodes: stitch_node, panorama_node, and base_node, what both share."""
