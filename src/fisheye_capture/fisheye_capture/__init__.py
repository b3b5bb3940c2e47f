"""A camera as a ROS 2 node: devices, pictures, videos, network streams, a synthetic scene."""
