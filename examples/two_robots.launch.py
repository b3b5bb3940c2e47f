"""Two robots, each with a panorama of its own: /alpha/panorama/image and /bravo/panorama/image.

ros2 launch examples/two_robots.launch.py
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import GroupAction, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch_ros.actions import PushRosNamespace

from launch import LaunchDescription

PANORAMA = Path(get_package_share_directory('panorama_stitch'), 'launch', 'panorama.launch.py')
ROBOTS = {
    # What `ros2 launch panorama_stitch panorama.launch.py --show-args` lists, such as
    # 'left_source': '/dev/v4l/by-path/...', 'left_camera_info_url': '~/alpha/left.yaml'
    'alpha': {'composed': 'true', 'left_source': 'synthetic', 'right_source': 'synthetic'},
    'bravo': {'composed': 'true', 'left_source': 'synthetic', 'right_source': 'synthetic'},
}


def generate_launch_description():
    """Start each robot's nodes in its namespace; the group keeps its arguments to itself."""
    return LaunchDescription(
        [
            GroupAction(
                [
                    PushRosNamespace(robot),
                    IncludeLaunchDescription(
                        PythonLaunchDescriptionSource(str(PANORAMA)),
                        launch_arguments=arguments.items(),
                    ),
                ]
            )
            for robot, arguments in ROBOTS.items()
        ]
    )
