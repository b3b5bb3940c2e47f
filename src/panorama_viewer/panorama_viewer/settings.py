"""Settings of the viewer node: the only place with their defaults."""

from dataclasses import dataclass

from fisheye_core.settings import setting
from fisheye_core.video_settings import EncoderSettings


@dataclass(frozen=True)
class ViewerSettings(EncoderSettings):
    """What the viewer node can be told."""

    host: str = setting(
        '127.0.0.1',
        'Address to serve on. 0.0.0.0 serves other machines too; looking and the buttons then '
        'need the token that is printed on the terminal at start.',
    )
    port: int = setting(8080, 'Port to serve on; 0: a free one.', minimum=0, maximum=65535)
    public: bool = setting(
        False, 'Everybody who reaches the port may look; the buttons still need the token.'
    )
    token_file: str = setting(
        '',
        'File that keeps the token from one start to the next; made, for its owner only, where '
        'there is none. Empty: a new token at each start.',
    )
    https: bool = setting(
        False,
        'Serve encrypted. Only so do browsers on other machines show H.264; else JPEG.',
    )
    certificate: str = setting(
        '',
        'Certificate for https, a PEM file. Empty: one of its own, made at the first start and '
        'kept in panorama_viewer.pem in ${ROS_HOME} (~/.ros).',
    )
    key: str = setting(
        '', 'Its private key, a PEM file without a password. Empty: it is in the certificate.'
    )
    save: bool = setting(
        False, 'Calibrate also saves the overlap, in the overlap_file of the node that stitches.'
    )
    max_clients: int = setting(
        8,
        'Browsers that may look at once; one without the token leaves for one that has it.',
        minimum=1,
        maximum=100,
    )
    stale_after_s: float = setting(
        1.0,
        'An older image is not shown to new browsers, and the page reports that none arrives.',
        minimum=0.1,
        maximum=60.0,
    )
    robot_width_m: float = setting(
        0.0,
        'Width of the robot: how far apart the lines of its path are on the page. 0: not known, '
        'and no path is shown.',
        minimum=0.0,
        maximum=20.0,
        live=True,
    )
    camera_height_m: float = setting(
        0.0,
        'Height of the cameras above the ground, for the same lines. 0: not known.',
        minimum=0.0,
        maximum=20.0,
        live=True,
    )
