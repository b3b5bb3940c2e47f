"""From one to eight cameras to a panorama: nodes for each, or one node with `composed:=true`.

Across a link the same file starts both halves: `robot:=true` the captures, `base:=true` the rest.
"""

import os
import sys
from pathlib import Path

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
)
from launch.actions import DeclareLaunchArgument, OpaqueFunction, SetEnvironmentVariable
from launch_ros.actions import Node, SetParameter

from fisheye_core.errors import FisheyeError
from fisheye_geometry.attitude import quaternion
from launch import LaunchDescription, logging
from panorama_stitch.launch_arguments import (
    ARGUMENTS,
    OF_CAMERA,
    arguments_of,
    attitudes,
    camera_names,
    check_names,
    checked,
)

PROFILE = Path(get_package_share_directory('fisheye_bridge')) / 'config' / 'fastdds.xml'
PROFILES = 'FASTRTPS_DEFAULT_PROFILES_FILE'
BOUND = 'FISHEYE_ENDS_WITH_PARENT'
"""launch that gets SIGTERM ends without a word to its nodes: they notice that it has gone."""
RESPAWN_DELAY_S = 2.0


def start(context):
    """Return what to start."""
    try:
        cameras = camera_names(context.launch_configurations['cameras'])
        if any(Path(word).name == Path(__file__).name for word in sys.argv):
            # Another file that includes this one may have arguments of its own.
            check_names(context.argv, cameras)
        arguments = checked(context.launch_configurations, cameras)
        return [SetParameter('use_sim_time', arguments['use_sim_time']), *nodes(arguments)]
    except FisheyeError as error:
        raise RuntimeError(str(error)) from error


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
    return {
        'cameras': '' if usual else names,
        'overlap_file': arguments['overlap_file'],
        'views': arguments['views'],
    }


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
    known = attitudes(arguments)
    if known is None:
        logging.get_logger('panorama').warning(
            f'the transforms are left out: {arguments["overlap_file"]} is not there yet, and '
            'yaw_deg is not given'
        )
        return []
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
        for camera, attitude in known.items()
    ]  # fmt: skip


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
