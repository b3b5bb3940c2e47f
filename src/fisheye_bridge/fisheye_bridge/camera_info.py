"""sensor_msgs/CameraInfo to lens and back."""

from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from fisheye_geometry.camera_file import Camera
from fisheye_geometry.errors import CalibrationError
from fisheye_geometry.lens import Lens, make_lens


def camera_of(message: CameraInfo, name: str = '') -> Camera:
    """Give the camera that a message describes.

    Raises
    ------
    CalibrationError
        If the camera is not calibrated, is binned or cropped, or the numbers describe no lens.
    """
    if not any(message.k):
        raise CalibrationError(
            'the camera is not calibrated (K is zero); make a calibration file with '
            'calibrate_lens and name it in camera_info_url'
        )
    if max(message.binning_x, message.binning_y) > 1:
        raise CalibrationError(
            f'binning is {message.binning_x}x{message.binning_y}; expected full pictures'
        )
    roi = message.roi
    if (roi.width or message.width, roi.height or message.height) != (
        message.width,
        message.height,
    ):
        raise CalibrationError(f'roi is {roi.width}x{roi.height} px; expected full pictures')
    lens = make_lens(message.distortion_model, message.width, message.height, message.k, message.d)
    return Camera(name, lens, tuple(map(float, message.r)), tuple(map(float, message.p)))


def camera_info_of(camera: Camera, header: Header) -> CameraInfo:
    """Describe a camera in a message."""
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
