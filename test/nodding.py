"""A rig on a robot that nods: rendered cameras and an IMU, published in real time."""

import threading
import time
from dataclasses import dataclass
from functools import lru_cache
from math import cos, pi, radians, sin

import cv2
import numpy as np
from sensor_msgs.msg import CameraInfo, Image, Imu
from std_msgs.msg import Header

from fisheye_bridge.camera_info import camera_info_of
from fisheye_bridge.qos import IMAGE
from fisheye_bridge.stamps import stamp_of
from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.camera import Camera
from fisheye_geometry.surface import Surface
from fisheye_testing.image_message import to_message

LENS = synthetic_lens(480, 360, radians(170))
MOUNTS = {'left': Attitude(radians(-70)), 'right': Attitude(radians(70))}
NOD_RAD, PERIOD_S = radians(10), 1.0
FRAMES, READINGS = 5, 50
"""A period."""
LATE_NS = 100_000_000
"""What a camera needs for a picture."""
SKY, GROUND = 190, 60
_AROUND = 2048


def nod(stamp_ns: int) -> Attitude:
    """Return the attitude of the robot in the world: it pitches, and rolls a little."""
    phase = 2 * pi * (stamp_ns % round(PERIOD_S * 1e9)) * 1e-9 / PERIOD_S
    return Attitude(0.0, NOD_RAD * sin(phase), 0.2 * NOD_RAD * cos(phase))


@lru_cache(1)
def world() -> tuple[Surface, np.ndarray]:
    """Return a sphere with a straight horizon; bright and dark blots above and below it."""
    height = _AROUND // 2
    random = np.random.default_rng(5)
    blots = random.normal(0, 1, (height, _AROUND)).astype(np.float32)
    blots = cv2.GaussianBlur(blots, (0, 0), 5)
    blots *= 18 / blots.std()
    picture = blots.clip(-45, 45) + np.where(np.arange(height) < height / 2, SKY, GROUND)[:, None]
    sphere = Surface(
        'equirectangular',
        _AROUND,
        height,
        _AROUND / (2 * pi),
        (_AROUND - 1) / 2,
        (height - 1) / 2,
    )
    return sphere, picture.clip(1, 255).astype(np.uint8)


def rendered(attitude: Attitude) -> np.ndarray:
    """Return what a camera of an attitude in the world sees, (height, width, 3) uint8."""
    sphere, picture = world()
    y, x = np.mgrid[: LENS.height, : LENS.width]
    rays, seen = LENS.unproject(np.dstack([x, y]))
    pixels, _ = sphere.project(rays @ attitude.matrix.T)
    where = pixels.astype(np.float32)
    image = cv2.remap(picture, where, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return cv2.cvtColor(np.where(seen, image, 0).astype(np.uint8), cv2.COLOR_GRAY2BGR)


@dataclass
class Drive:
    """Publishes pictures and readings until it is stopped.

    Attributes
    ----------
    has_orientation
        Whether the IMU gives one; otherwise accelerations and turns.
    """

    node: object
    has_orientation: bool = True

    def __post_init__(self):
        self.has_imu = True
        self._over = threading.Event()
        step_ns = round(PERIOD_S / FRAMES * 1e9)
        self._pictures = [
            {
                side: rendered(Attitude.of(nod(k * step_ns).matrix @ mount.matrix))
                for side, mount in MOUNTS.items()
            }
            for k in range(FRAMES)
        ]
        create = self.node.create_publisher
        self._images = {side: create(Image, f'{side}/image_raw', IMAGE) for side in MOUNTS}
        self._infos = {side: create(CameraInfo, f'{side}/camera_info', IMAGE) for side in MOUNTS}
        self._imu = create(Imu, 'imu', 50)
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def stop(self):
        """End."""
        self._over.set()
        self._thread.join()

    def _run(self):
        period_ns = round(PERIOD_S * 1e9)
        begin_ns = (time.time_ns() // period_ns + 1) * period_ns
        reading = frame = 0
        while True:
            reading_ns = begin_ns + reading * period_ns // READINGS
            frame_ns = begin_ns + frame * period_ns // FRAMES
            due_ns = min(reading_ns, frame_ns + LATE_NS)
            if self._over.wait(max(0.0, (due_ns - time.time_ns()) * 1e-9)):
                return
            if reading_ns == due_ns:
                reading += 1
                if self.has_imu:
                    self._imu.publish(self._reading(reading_ns))
            else:
                self._show(frame % FRAMES, frame_ns)
                frame += 1

    def _show(self, index, stamp_ns):
        for side, picture in self._pictures[index].items():
            header = Header(stamp=stamp_of(stamp_ns), frame_id=f'{side}_optical_frame')
            self._infos[side].publish(camera_info_of(Camera(side, LENS), header))
            self._images[side].publish(to_message(picture, 'bgr8', header))

    def _reading(self, stamp_ns):
        """Return a message in the frame of REP-103: x ahead, y left, z up."""
        message = Imu(header=Header(stamp=stamp_of(stamp_ns), frame_id='base_link'))
        matrix = nod(stamp_ns).matrix
        up = -matrix.T @ (0.0, 1.0, 0.0)
        if self.has_orientation:
            # The rotation (optical) as a rotation of x ahead, y left, z up.
            to_body = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
            vector = cv2.Rodrigues(to_body @ matrix @ to_body.T)[0].ravel()
            angle = float(np.linalg.norm(vector))
            axis = vector / max(angle, 1e-12) * sin(angle / 2)
            q = message.orientation
            (q.x, q.y, q.z), q.w = map(float, axis), cos(angle / 2)
            return message
        message.orientation_covariance[0] = -1.0
        a, w = message.linear_acceleration, message.angular_velocity
        a.x, a.y, a.z = (9.81 * float(each) for each in (up[2], -up[0], -up[1]))
        step_ns = 1_000_000
        later = cv2.Rodrigues(matrix.T @ nod(stamp_ns + step_ns).matrix)[0].ravel()
        turn = later / (step_ns * 1e-9)
        w.x, w.y, w.z = float(turn[2]), float(-turn[0]), float(-turn[1])
        return message
