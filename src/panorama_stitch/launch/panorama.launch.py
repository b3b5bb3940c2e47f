"""From one to eight cameras to a panorama: nodes for each, or one node with `composed:=true`.

Across a link the same file starts both halves: `robot:=true` the captures, `base:=true` the rest.
"""

import os
import re
import sys
from contextlib import suppress
from math import isfinite, radians
from pathlib import Path

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
)
from launch.actions import DeclareLaunchArgument, OpaqueFunction, SetEnvironmentVariable
from launch_ros.actions import Node, SetParameter

from fisheye_core.errors import FisheyeError
from fisheye_geometry.attitude import Attitude, quaternion
from launch import LaunchDescription, logging
from panorama_stitch.overlap.saved_rig import saved_rig

CONFIG = Path(get_package_share_directory('panorama_stitch')) / 'config'
PROFILE = Path(get_package_share_directory('fisheye_bridge')) / 'config' / 'fastdds.xml'
ARGUMENTS = {
    'cameras': ('left,right', 'names of 1 to 8 cameras, from left to right'),
    'composed': ('false', 'one process from cameras to panorama instead of several'),
    'robot': ('false', 'only the captures, on the robot'),
    'base': ('false', 'all but the captures, at the other end of the link'),
    'params_file': (str(CONFIG / 'panorama.yaml'), 'parameters that differ from the defaults'),
    'transport': ('', 'how pictures are taken from topics: raw or compressed'),
    'frame_rate_hz': ('', 'frames a second of each camera'),
    'overlap_file': ('', 'where the overlap is read at start and saved on request'),
    'view': ('false', 'also show the panorama in a browser'),
    'host': ('', 'address on which browsers are served; 0.0.0.0 for other machines too'),
    'transforms': ('false', 'also publish where the optical frames of the cameras point'),
    'yaw_deg': ('', 'angle between the cameras; from overlap_file if it is not given'),
    'use_sim_time': ('false', 'go by /clock, as a recording that is played back provides it'),
}
OF_CAMERA = {
    'source': 'what the camera is: device, picture, folder, video or URL',
    'camera_info_url': 'calibration file of the camera',
    'region': "part of the source's frames that the camera is; cameras share it if composed",
}
"""Arguments of each camera, behind its name: `front_source`."""
FLAGS = tuple(name for name, (value, _) in ARGUMENTS.items() if value == 'false')
OF_LAUNCH = ('launch-prefix', 'launch-prefix-filter', 'emulate_tty', 'ros_namespace')
"""What launch itself and launch_ros take beside a file's own arguments."""
PROFILES = 'FASTRTPS_DEFAULT_PROFILES_FILE'
BOUND = 'FISHEYE_ENDS_WITH_PARENT'
"""launch that gets SIGTERM ends without a word to its nodes: they notice that it has gone."""
RESPAWN_DELAY_S = 2.0
MAX_CAMERAS = 8
NAME = r'[A-Za-z]\w*(/[A-Za-z]\w*)*'
YES, NO = ('true', '1', 'yes', 'on'), ('false', '0', 'no', 'off')


def start(context):
    """Return what to start."""
    cameras = camera_names(context.launch_configurations['cameras'])
    check_names(context.argv, cameras)
    arguments = checked(context.launch_configurations, cameras)
    return [SetParameter('use_sim_time', arguments['use_sim_time']), *nodes(arguments)]


def camera_names(text):
    """Read the names of the cameras."""
    names = [name.strip() for name in text.split(',')]
    for name in names:
        if not re.fullmatch(NAME, name, re.ASCII):
            raise RuntimeError(
                f"cameras has '{name}'; expected names of a letter, then letters, digits or _, "
                'with commas between them'
            )
    if len(set(names)) != len(names) or len(names) > MAX_CAMERAS:
        raise RuntimeError(f'cameras is {text}; expected 1 to {MAX_CAMERAS} different names')
    return names


def arguments_of(cameras):
    """Return the arguments of cameras, with their descriptions."""
    return {
        f'{camera}_{name}': f'{text} ({camera})'
        for camera in cameras
        for name, text in OF_CAMERA.items()
    }


def check_names(words, cameras):
    """Refuse arguments of the command line that nobody has."""
    if not any(Path(word).name == Path(__file__).name for word in sys.argv):
        return  # another file includes this one, and may have arguments of its own
    known = (*ARGUMENTS, *arguments_of(cameras))
    for name in (word.partition(':=')[0] for word in words):
        if name not in (*known, *OF_LAUNCH):
            raise RuntimeError(f"there is no argument '{name}'; expected {', '.join(known)}")


def checked(arguments, cameras):
    """Return the arguments, those that are true or false as bool, the cameras as a list."""
    flags = {name: flag(name, arguments[name]) for name in FLAGS}
    paths = {name: os.path.expanduser(arguments[name]) for name in ('params_file', 'overlap_file')}
    if not Path(paths['params_file']).is_file():
        raise RuntimeError(f"params_file is '{paths['params_file']}', which is not a file")
    rate = arguments['frame_rate_hz']
    rates = {'frame_rate_hz': number('frame_rate_hz', rate)} if rate else {}
    # Those of cameras that are not declared are there only if they were given.
    own = {name: arguments.get(name, '') for name in arguments_of(cameras)}
    return {**arguments, **own, **flags, **paths, **rates, 'cameras': cameras}


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
            **of_camera(arguments, camera),
            frame_rate_hz=arguments['frame_rate_hz'],
        )
        for camera in arguments['cameras']
    ]


def of_camera(arguments, camera):
    """Return the parameters of a camera's own arguments."""
    return {name: arguments[f'{camera}_{name}'] for name in OF_CAMERA}


def of_stitch(arguments):
    """Return the parameters of a node that makes the panorama."""
    names = arguments['cameras']
    usual = ','.join(names) == ARGUMENTS['cameras'][0]  # params_file may know better
    return {'cameras': '' if usual else names, 'overlap_file': arguments['overlap_file']}


def separate(arguments):
    """Return the nodes that make the panorama of what the captures publish."""
    corrections = [
        node(arguments, 'fisheye_undistort', 'undistort', camera, transport=arguments['transport'])
        for camera in arguments['cameras']
    ]
    return [*corrections, node(arguments, 'panorama_stitch', 'stitch', **of_stitch(arguments))]


def composed(arguments):
    """Return the node that does all; at the base of a link it takes the captures' topics."""
    own = {
        f'{camera}.{name}': value
        for camera in arguments['cameras']
        for name, value in of_camera(arguments, camera).items()
    }
    if arguments['base']:
        own.update({f'{camera}.source': 'topic' for camera in arguments['cameras']})
    shared = {name: arguments[name] for name in ('frame_rate_hz', 'transport')}
    of_panorama = {**of_stitch(arguments), **own, **shared}
    return [node(arguments, 'panorama_stitch', 'panorama', **of_panorama)]


def transforms(arguments):
    """Publish how the optical frames of the cameras are turned in the panorama's level frame."""
    check_tf2()  # nothing has been started yet
    return [
        Node(
            package='tf2_ros',
            executable='static_transform_publisher',
            name=f'{camera.replace("/", "_")}_transform',
            arguments=[
                '--frame-id', 'panorama_optical_frame',
                '--child-frame-id', f'{camera}_optical_frame',
                *(
                    word
                    for axis, value in zip('xyzw', quaternion(attitude), strict=True)
                    for word in (f'--q{axis}', f'{value:.9f}')
                ),
            ],
        )
        for camera, attitude in attitudes(arguments).items()
    ]  # fmt: skip


def attitudes(arguments):
    """Return the attitudes of the cameras as given or else measured; none if not measured yet."""
    cameras, path = arguments['cameras'], arguments['overlap_file']
    if arguments['yaw_deg']:
        if len(cameras) != 2:
            raise RuntimeError(
                f'yaw_deg is the angle between two cameras; there are {len(cameras)} (see '
                'overlap_file)'
            )
        half_rad = radians(number('yaw_deg', arguments['yaw_deg'])) / 2
        return dict(zip(cameras, (Attitude(-half_rad), Attitude(half_rad)), strict=True))
    if not path:
        raise RuntimeError('transforms:=true needs yaw_deg or overlap_file')
    try:
        rig = saved_rig(path, cameras)
    except FisheyeError as error:
        raise RuntimeError(str(error)) from error
    if rig is None:
        logging.get_logger('panorama').warning(
            f'the transforms are left out: {path} is not there yet, and yaw_deg is not given'
        )
        return {}
    if rig.apart:
        raise RuntimeError(f'{path} holds no angle between the cameras; give yaw_deg')
    return {camera.name: camera.attitude for camera in rig.cameras}


def generate_launch_description():
    """Start what the arguments say, with the profile without which large images get lost."""
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=value, description=text)
                for name, (value, text) in ARGUMENTS.items()
            ),
            *(
                DeclareLaunchArgument(name, default_value='', description=text)
                for name, text in arguments_of(ARGUMENTS['cameras'][0].split(',')).items()
            ),
            SetEnvironmentVariable(PROFILES, os.environ.get(PROFILES, str(PROFILE))),
            SetEnvironmentVariable(BOUND, '1'),
            OpaqueFunction(function=start),
        ]
    )
