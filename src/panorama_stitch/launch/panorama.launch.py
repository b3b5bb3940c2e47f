"""From two cameras to a panorama: five nodes, or one with `composed:=true`.

Across a link the same file starts both halves: `robot:=true` the captures, `base:=true` the rest.
"""

import os
import sys
from contextlib import suppress
from math import cos, degrees, isfinite, radians, sin
from pathlib import Path

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
)
from launch.actions import DeclareLaunchArgument, OpaqueFunction, SetEnvironmentVariable
from launch_ros.actions import Node, SetParameter

from fisheye_core.errors import FileAccessError, FileContentError
from fisheye_core.yaml_file import read_mapping
from fisheye_geometry.surface_kind import KINDS
from launch import LaunchDescription, logging

CONFIG = Path(get_package_share_directory('panorama_stitch')) / 'config'
PROFILE = Path(get_package_share_directory('fisheye_bridge')) / 'config' / 'fastdds.xml'
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

FLAGS = tuple(name for name, (value, _) in ARGUMENTS.items() if value == 'false')
OF_LAUNCH = ('launch-prefix', 'launch-prefix-filter', 'emulate_tty', 'ros_namespace')
"""What launch itself and launch_ros take beside a file's own arguments."""
PROFILES = 'FASTRTPS_DEFAULT_PROFILES_FILE'
BOUND = 'FISHEYE_ENDS_WITH_PARENT'
"""launch that gets SIGTERM ends without a word to its nodes: they notice that it has gone."""
RESPAWN_DELAY_S = 2.0
YES, NO = ('true', '1', 'yes', 'on'), ('false', '0', 'no', 'off')


def start(context):
    """Return what to start."""
    check_names(context.argv)
    arguments = checked(context.launch_configurations)
    return [SetParameter('use_sim_time', arguments['use_sim_time']), *nodes(arguments)]


def check_names(words):
    """Refuse arguments of the command line that do not exist."""
    if not any(Path(word).name == Path(__file__).name for word in sys.argv):
        return  # another file includes this one, and may have arguments of its own
    for name in (word.partition(':=')[0] for word in words):
        if name not in (*ARGUMENTS, *OF_LAUNCH):
            raise RuntimeError(f"there is no argument '{name}'; expected {', '.join(ARGUMENTS)}")


def checked(arguments):
    """Return the arguments, those that are true or false as bool."""
    flags = {name: flag(name, arguments[name]) for name in FLAGS}
    paths = {name: os.path.expanduser(arguments[name]) for name in ('params_file', 'overlap_file')}
    if not Path(paths['params_file']).is_file():
        raise RuntimeError(f"params_file is '{paths['params_file']}', which is no file")
    rate = arguments['frame_rate_hz']
    rates = {'frame_rate_hz': number('frame_rate_hz', rate)} if rate else {}
    return {**arguments, **flags, **paths, **rates}


def flag(name, text):
    """Read an argument that is true or false."""
    if text.lower() not in (*YES, *NO):
        raise RuntimeError(f"{name} is '{text}'; expected true or false")
    return text.lower() in YES


def number(name, text):
    """Read an argument that is a number; launch_ros would hand text on as text."""
    with suppress(ValueError):
        if isfinite(value := float(text)):
            return value
    raise RuntimeError(f"{name} is '{text}'; expected a number")


def check_tf2():
    """Refuse to start anything if what publishes the transforms is not there."""
    try:
        get_package_prefix('tf2_ros')
    except PackageNotFoundError as error:
        raise RuntimeError(
            'transforms:=true needs the package tf2_ros (sudo apt install ros-jazzy-tf2-ros)'
        ) from error


def nodes(arguments):
    """Return the nodes to start."""
    robot, base = arguments['robot'], arguments['base']
    started = []
    if robot or not (base or arguments['composed']):
        started += captures(arguments)
    if base or not robot:
        started += (composed if arguments['composed'] else separate)(arguments)
        if arguments['view']:
            started.append(node(arguments, 'panorama_viewer', 'viewer', host=arguments['host']))
        if arguments['transforms']:
            started += transforms(arguments)
    return started


def node(arguments, package, name, namespace='', **parameters):
    """Start one node; what was not given leaves its parameter alone."""
    given = {parameter: value for parameter, value in parameters.items() if value != ''}
    return Node(
        package=package,
        executable=f'{name}_node',
        name=name,
        namespace=namespace,
        parameters=[arguments['params_file'], given],
        output='screen',
        respawn=True,
        respawn_delay=RESPAWN_DELAY_S,
    )


def captures(arguments):
    """Return the nodes that read the cameras."""
    return [
        node(
            arguments,
            'fisheye_capture',
            'capture',
            camera,
            source=arguments[f'{camera}_source'],
            camera_info_url=arguments[f'{camera}_camera_info_url'],
            frame_rate_hz=arguments['frame_rate_hz'],
        )
        for camera in CAMERAS
    ]


def separate(arguments):
    """Return the nodes that make the panorama of what the captures publish."""
    transport, overlap_file = arguments['transport'], arguments['overlap_file']
    corrections = [
        node(arguments, 'fisheye_undistort', 'undistort', camera, transport=transport)
        for camera in CAMERAS
    ]
    return [*corrections, node(arguments, 'panorama_stitch', 'stitch', overlap_file=overlap_file)]


def composed(arguments):
    """Return the node that does all; at the base of a link it takes the captures' topics."""
    own = {
        f'{camera}.{name}': arguments[f'{camera}_{name}']
        for camera in CAMERAS
        for name in ('source', 'camera_info_url')
    }
    if arguments['base']:
        own.update({f'{camera}.source': 'topic' for camera in CAMERAS})
    shared = {name: arguments[name] for name in ('frame_rate_hz', 'overlap_file', 'transport')}
    return [node(arguments, 'panorama_stitch', 'panorama', **own, **shared)]


def transforms(arguments):
    """Turn the optical frames of the cameras away from the panorama's, by half the angle each."""
    check_tf2()  # nothing has been started yet
    yaw_deg = angle_between_cameras_deg(arguments['yaw_deg'], arguments['overlap_file'])
    if yaw_deg is None:
        return []
    yaw_rad = radians(yaw_deg)
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


def angle_between_cameras_deg(given, path):
    """Return the angle as it was given or else measured, deg; None if it is not measured yet."""
    if given:
        return number('yaw_deg', given)
    if not path:
        raise RuntimeError('transforms:=true needs yaw_deg or overlap_file')
    if Path(path).exists():
        return measured_yaw_deg(path)
    logging.get_logger('panorama').warning(
        f'the transforms are left out: {path} is not there yet, and yaw_deg is not given'
    )
    return None


def measured_yaw_deg(path):
    """Return the angle between the two axes that was measured and saved, deg."""
    try:
        saved = read_mapping(path)
        (left, right), (overlap,) = saved['cameras'], saved['overlaps']
        is_angle = overlap['found'] and KINDS[left['surface']].yaw_is_column_shift
        apart_px = overlap['offset_x_px'] + right['center_x_px'] - left['center_x_px']
        yaw_deg = degrees(apart_px / left['focal_px'])
    except (FileAccessError, FileContentError) as error:
        reason = error.reason
        raise RuntimeError(f'{path} is not the overlap file of two cameras: {reason}') from error
    except (KeyError, TypeError, ValueError, ArithmeticError) as error:
        raise RuntimeError(f'{path} is not the overlap file of two cameras') from error
    if not is_angle:
        raise RuntimeError(f'{path} holds no angle between the cameras; give yaw_deg')
    return yaw_deg


def generate_launch_description():
    """Start what the arguments say, with the profile without which large images get lost."""
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=value, description=text)
                for name, (value, text) in ARGUMENTS.items()
            ),
            SetEnvironmentVariable(PROFILES, os.environ.get(PROFILES, str(PROFILE))),
            SetEnvironmentVariable(BOUND, '1'),
            OpaqueFunction(function=start),
        ]
    )
