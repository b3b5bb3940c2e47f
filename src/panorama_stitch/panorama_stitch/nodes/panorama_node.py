"""Cameras to panorama in one process: each image is warped straight into its place."""

from fisheye_bridge.diagnostics import Report
from fisheye_bridge.running import run
from fisheye_capture.capture_settings import CameraSettings
from panorama_stitch.nodes.base_node import PanoramaBase
from panorama_stitch.nodes.camera_input import camera_inputs
from panorama_stitch.pipeline.panorama_settings import MountSettings, PanoramaSettings
from panorama_stitch.pipeline.view_settings import ViewSettings


class PanoramaNode(PanoramaBase):
    """The cameras themselves to panorama/image."""

    SETTINGS = (
        ('', PanoramaSettings),
        ('CAMERA.', CameraSettings),
        ('CAMERA.', MountSettings),
        ('VIEW.', ViewSettings),
    )

    def __init__(self, **kwargs):
        self._inputs, self._readers = [], []
        super().__init__('panorama', PanoramaSettings, **kwargs)
        self._inputs, self._readers = camera_inputs(self)
        for reader in self._readers:
            reader.start()

    def destroy_node(self) -> None:
        """Release the cameras too."""
        for reader in self._readers:
            reader.stop()
        super().destroy_node()

    def _apply(self, settings: PanoramaSettings) -> None:
        for camera in self._inputs:
            camera.check(settings)  # all or none: nothing is refused half-way
        super()._apply(settings)
        for camera in self._inputs:
            camera.place(settings)

    def _report(self, report: Report) -> None:
        super()._report(report)
        for part in (*self._readers, *self._inputs):
            part.report(report)


def main() -> int:
    """Run the node."""
    return run(PanoramaNode)
