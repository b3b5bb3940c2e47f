"""Five nodes, or one, on two network cameras: a rig that can be hurt and watched."""

import os
import time
from contextlib import contextmanager
from math import radians
from pathlib import Path

import cv2

from fisheye_capture.scene import Scene
from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.camera_file import Camera, write_camera
from fisheye_testing.again import TooSlowError
from fisheye_testing.health import Health
from fisheye_testing.mjpeg_server import MjpegServer
from fisheye_testing.rig import SIDES, RigProcesses
from fisheye_testing.waiting import wait_for

START_S = 60.0
"""For what happens some time, even where much else runs too."""
BUSY_S = 180.0
"""For what other work on the machine holds up: that ends some time."""
RETURN_S = 3.0
"""Within it the panorama is whole again when what was broken is back."""
STOP_S = 2.0
"""Within it a node has ended."""
MAY_LOSE = 0.0 if os.environ.get('LONG') else 0.03
"""Share of the pairs that a busy machine may lose; the long form wants a quiet one."""
UNNOTICED_S = 1.5
"""No fault of one side costs more: `stale_after_s` until it counts as lost, and hiccups."""


def write_pictures(folder: Path) -> None:
    """Write what two cameras see of the synthetic scene, with their exact calibrations."""
    lens = synthetic_lens(640, 480, radians(170))
    for side, yaw_deg in zip(SIDES, (-70, 70), strict=True):
        picture = Scene().view(lens, Attitude(radians(yaw_deg))).frame(0)
        cv2.imwrite(str(folder / f'{side}.jpg'), picture)
        write_camera(folder / f'{side}.yaml', Camera(side, lens))


def calibrated(watcher, **request):
    """Return the answer to `calibrate_overlap`; a busy machine is asked again until it is done."""

    def answered():
        answer = watcher.calibrate(**request)
        return answer if answer.success else None

    return wait_for(answered, START_S, 'a measured overlap')


class HttpCameras:
    """Two network cameras in the synthetic scene.

    Attributes
    ----------
    servers, pictures : dict
        Each camera's `MjpegServer` and its JPEG by its side.
    """

    RATE_HZ = 20.0

    def __init__(self, folder: Path):
        write_pictures(folder)
        self._folder = folder
        self.pictures = {side: (folder / f'{side}.jpg').read_bytes() for side in SIDES}
        self.servers = {side: self._serve(side, 0) for side in SIDES}

    def stop(self, side: str) -> None:
        """Switch a camera off."""
        self.servers[side].stop()

    def start(self, side: str) -> None:
        """Switch a camera on again, at its old address."""
        self.servers[side] = self._serve(side, self.servers[side].port)

    def show(self, side: str, picture: bytes | None = None) -> None:
        """Make a running camera send another picture, or its own again."""
        self.servers[side].picture = self.pictures[side] if picture is None else picture

    def parameters(self, side: str) -> dict[str, str]:
        """Return the parameters of a capture node."""
        calibration = self._folder / f'{side}.yaml'
        return {'source': self.servers[side].url, 'camera_info_url': str(calibration)}

    def _serve(self, side: str, port: int) -> MjpegServer:
        return MjpegServer(self.pictures[side], rate_hz=self.RATE_HZ, port=port)


class Field(RigProcesses):
    """Five nodes on two network cameras, as a robot has them.

    Attributes
    ----------
    cameras : HttpCameras
    health : Health
    """

    def __init__(self, domain: int, folder: Path):
        super().__init__(domain, folder / 'log')
        self.domain = domain
        self.cameras = HttpCameras(folder)
        self.health = Health(domain)
        self.overlap_file = folder / 'overlap.yaml'

    def __exit__(self, *arguments) -> None:
        super().__exit__(*arguments)
        self.health.__exit__()
        for side in SIDES:
            self.cameras.stop(side)

    def start_five(self) -> None:
        """Start the nodes and wait for a steady panorama whose overlap is saved."""
        for side, transport in zip(SIDES, ('raw', 'compressed'), strict=True):
            self.start(f'{side}/capture', **self.cameras.parameters(side))
            self.start(f'{side}/undistort', transport=transport)
        self.start('stitch', overlap_file=self.overlap_file)
        self.wait_for_start()

    def start_one(self) -> None:
        """Start the same as one node."""
        parameters = {
            f'{side}.{name}': value
            for side in SIDES
            for name, value in self.cameras.parameters(side).items()
        }
        self.start('panorama', overlap_file=self.overlap_file, **parameters)
        self.wait_for_start()

    def wait_for_start(self) -> None:
        """Wait for a steady panorama, and save its overlap."""
        wait_for(lambda: self.check_alive() or self.health.newest, START_S, 'a first panorama')
        # Until the cameras' image circles are known, it is measured anew.
        calibrated(self.health, save=True)
        self.health.settle()

    def endpoints(self, node: str) -> set[bytes]:
        """Return the identities under which a node reports, now and before it was killed."""
        namespace, _, name = f'/{node}'.rpartition('/')
        return {
            bytes(end.endpoint_gid)
            for end in self.health.node.get_publishers_info_by_topic('/diagnostics')
            if (end.node_namespace, end.node_name) == (namespace or '/', name)
        }

    @contextmanager
    def injured(self, what: str, *sides: str, node: str = ''):
        """Break and mend something inside; what it cost is printed, and that nothing else broke.

        Parameters
        ----------
        what
            Is broken.
        *sides
            'left' and 'right' where that half may be dimmed, 'panorama' where none may come.
        node
            That may end.

        Raises
        ------
        TooSlowError
            If something else was affected, or what was mended was not whole in time: both may be
            other work on the machine.
        """
        begin_s = time.monotonic()
        others = {name: p.pid for name, p in self.processes.items() if name != node}
        yield
        mended_s = time.monotonic()
        wait_for(lambda: self.health.whole(mended_s), START_S, f'the end of: {what}')
        back_s = time.monotonic() - mended_s
        cost = dict(zip(('panorama', *SIDES), self.health.suffering(begin_s), strict=True))
        print(
            f'\n{what}: no panorama for {cost["panorama"]:.1f} s, '
            f'left half dimmed {cost["left"]:.1f} s, right half {cost["right"]:.1f} s; '
            f'whole {back_s:.1f} s after its end; ',
            end='',
        )
        self.check_alive()
        assert others == {name: p.pid for name, p in self.processes.items() if name != node}
        if any(part not in sides and cost[part] >= UNNOTICED_S for part in cost):
            raise TooSlowError(f'{what}: {cost}')
        print('nothing else was affected')
        if back_s >= RETURN_S:
            raise TooSlowError(f'{what}: whole after {back_s:.1f} s')
