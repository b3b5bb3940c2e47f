"""sensor_msgs/CameraInfo to lens and back."""

from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from fisheye_core.errors import CalibrationError
from fisheye_geometry.camera import Camera, Readout, camera_from
from fisheye_geometry.lens import Lens, make_lens


def camera_of(message: CameraInfo, name: str = '') -> Camera:
    """Return the camera whose pictures come with a message: binned and cropped as it says.

    Raises
    ------
    CalibrationError
        If the camera is not calibrated, or the numbers describe no lens or no part of its sensor.
    """
    return readout_of(message).of(camera_from(name, _lens(message), message.r, message.p))


def lens_of(message: CameraInfo) -> Lens:
    """Return the lens of that camera, whatever R and P are, which nobody needs for it.

    Raises
    ------
    CalibrationError
        As `camera_of` does.
    """
    return readout_of(message).of(Camera('', _lens(message))).lens


def _lens(message: CameraInfo) -> Lens:
    if not any(message.k):
        raise CalibrationError(
            'the camera is not calibrated (K is zero); make a calibration file with '
            'calibrate_lens and name it in camera_info_url'
        )
    return make_lens(message.distortion_model, message.width, message.height, message.k, message.d)


def readout_of(message: CameraInfo) -> Readout:
    """Return the part of the sensor that a message names."""
    roi = message.roi
    return Readout(
        x_offset=roi.x_offset,
        y_offset=roi.y_offset,
        width=roi.width,
        height=roi.height,
        binning_x=message.binning_x,
        binning_y=message.binning_y,
    )


def camera_info_of(camera: Camera, header: Header) -> CameraInfo:
    """Describe a camera in a message, the pictures as all of its sensor."""
    lens: Lens = camera.lens
    return CameraInfo(
        header=header,
        width=lens.width,
        height=lens.height,
        distortion_model=lens.ros_model,
        d=list(lens.distortion),
        k=lens.matrix.ravel(),
        r=list(camera.rectification),
        p=camera.projection_matrix.ravel(),
    )
