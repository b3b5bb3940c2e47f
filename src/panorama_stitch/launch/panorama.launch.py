"""From two cameras to a panorama: five nodes, or one with `composed:=true`.

Across a link the same file starts both halves: `robot:=true` the captures, `base:=true` the rest.
"""

from math import cos, degrees, radians, sin
from pathlib import Path

import yaml
from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument, OpaqueFunction, SetEnvironmentVariable
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node, SetParameter

from launch import LaunchDescription

CONFIG = Path(get_package_share_directory('panorama_stitch')) / 'config'
CAMERAS = ('left', 'right')
ARGUMENTS = {
    'composed': ('false', 'one process from cameras to panorama instead of five nodes'),
    'robot': ('false', 'only the captures, on the robot'),
    'base': ('false', 'all but the captures, at the other end of the link'),
    'params_file': (str(CONFIG / 'panorama.yaml'), 'parameters that differ from the defaults'),
    'transport': ('', 'how pictures are taken from topics: raw or compressed'),
    'frame_rate_hz': ('', 'frames a second of each camera'),
    'overlap_file': ('', 'where the overlap is read at start and saved on request'),
    'left_source': ('', 'what the left camera is: device, picture, folder, video or URL'),
    'right_source': ('', 'what the right camera is'),
    'left_camera_info_url': ('', 'calibration file of the left camera'),
    'right_camera_info_url': ('', 'calibration file of the right camera'),
    'view': ('false', 'also show the panorama in a browser'),
    'host': ('', 'address on which browsers are served; 0.0.0.0 for other machines too'),
    'transforms': ('false', 'also publish where the optical frames of the cameras point'),
    'yaw_deg': ('', 'angle between the cameras; from overlap_file if it is not given'),
    'use_sim_time': ('false', 'go by /clock, as a recording that is played gives it'),
}


def nodes(context):
    """Say which nodes to start; an argument that was not given leaves the parameter alone."""
    arguments = dict(context.launch_configurations)
    robot, base, composed = (arguments[name] == 'true' for name in ('robot', 'base', 'composed'))
    if base and composed:
        arguments.update({f'{camera}_source': 'topic' for camera in CAMERAS})

    def parameters(**names):
        given = {name: arguments[argument] for name, argument in names.items()}
        return [arguments['params_file'], {name: text for name, text in given.items() if text}]

    def node(package, executable, name, namespace='', **names):
        return Node(
            package=package,
            executable=executable,
            name=name,
            namespace=namespace,
            parameters=parameters(**names),
            output='screen',
        )

    extras = []
    if arguments['view'] == 'true':
        extras.append(node('panorama_stitch', 'viewer_node', 'viewer', host='host'))
    if arguments['transforms'] == 'true':
        extras += transforms(arguments)
    captures = [
        node(
            'fisheye_capture',
            'capture_node',
            'capture',
            camera,
            source=f'{camera}_source',
            camera_info_url=f'{camera}_camera_info_url',
            frame_rate_hz='frame_rate_hz',
        )
        for camera in CAMERAS
    ]
    if composed:
        own = {
            f'{camera}.{name}': f'{camera}_{name}'
            for camera in CAMERAS
            for name in ('source', 'camera_info_url')
        }
        shared = {name: name for name in ('frame_rate_hz', 'overlap_file', 'transport')}
        rest = [node('panorama_stitch', 'panorama_node', 'panorama', **own, **shared)]
    else:
        rest = [
            node('fisheye_undistort', 'undistort_node', 'undistort', camera, transport='transport')
            for camera in CAMERAS
        ]
        rest.append(node('panorama_stitch', 'stitch_node', 'stitch', overlap_file='overlap_file'))
    has_captures = robot or not (base or composed)
    has_rest = base or not robot
    return (captures if has_captures else []) + (rest + extras if has_rest else [])


def transforms(arguments):
    """Turn the optical frames of the cameras away from the panorama's, by half the angle each."""
    yaw_rad = radians(float(arguments['yaw_deg'] or measured_yaw_deg(arguments['overlap_file'])))
    return [
        Node(
            package='tf2_ros',
            executable='static_transform_publisher',
            name=f'{camera}_transform',
            # In an optical frame y points down: a turn about it is one to the right.
            arguments=[
                '--frame-id', 'panorama_optical_frame',
                '--child-frame-id', f'{camera}_optical_frame',
                '--qy', f'{sin(turn_rad / 2):.9f}',
                '--qw', f'{cos(turn_rad / 2):.9f}',
            ],
        )
        for camera, turn_rad in zip(CAMERAS, (-yaw_rad / 2, yaw_rad / 2), strict=True)
    ]  # fmt: skip


def measured_yaw_deg(path):
    """Give the angle between the two axes that was measured and saved, deg."""
    if not Path(path).is_file():
        raise RuntimeError(f"transforms:=true needs yaw_deg or overlap_file; '{path}' is no file")
    saved = yaml.safe_load(Path(path).read_text())
    (left, right), (overlap,) = saved['cameras'], saved['overlaps']
    if not overlap['found'] or left['surface'] == 'rectilinear':
        raise RuntimeError(f'{path} holds no angle between the cameras; give yaw_deg')
    apart_px = overlap['offset_x_px'] + right['center_x_px'] - left['center_x_px']
    return degrees(apart_px / left['focal_px'])


def generate_launch_description():
    """Start what the arguments say, with the profile without which large images get lost."""
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=value, description=text)
                for name, (value, text) in ARGUMENTS.items()
            ),
            SetEnvironmentVariable('FASTRTPS_DEFAULT_PROFILES_FILE', str(CONFIG / 'fastdds.xml')),
            SetParameter('use_sim_time', LaunchConfiguration('use_sim_time')),
            OpaqueFunction(function=nodes),
        ]
    )
