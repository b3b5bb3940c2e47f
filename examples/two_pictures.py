"""Two pictures and their calibrations to one panorama, without ROS.

    python examples/two_pictures.py FOLDER PANORAMA

FOLDER holds left.png, right.png and their calibrations left.yaml, right.yaml.
"""

import sys
from pathlib import Path

import cv2
import numpy as np

from fisheye_core.picture_file import read_picture
from fisheye_geometry.camera_file import read_camera
from fisheye_geometry.lens_surface import surface_for
from fisheye_geometry.rig_solution import solve_rig
from panorama_stitch.compose.build import Style, build_compositor
from panorama_stitch.compose.posing import views_of_rig
from panorama_stitch.overlap.measure import measure_rotation
from panorama_stitch.overlap.view import OverlapView

folder, output, sides = Path(sys.argv[1]), sys.argv[2], ('left', 'right')
images = [read_picture(folder / f'{side}.png') for side in sides]
lenses = [read_camera(folder / f'{side}.yaml').lens for side in sides]

found = measure_rotation([tuple(map(OverlapView, images, lenses))])
if not found.found:
    sys.exit('The pictures have too little in common.')
rig = solve_rig([*zip(sides, lenses, strict=True)], [found.rotation.as_matrix()]).rig

surfaces = [surface_for(lens, 'cylindrical') for lens in lenses]
surfaces = [surface.with_focal(surfaces[0].focal_px) for surface in surfaces]
compositor = build_compositor(views_of_rig(rig, surfaces), images, Style())
width, height = compositor.layout.surface.size
panorama = np.empty((height, width, 3), np.uint8)
compositor.compose(images, panorama)
cv2.imwrite(output, panorama)
print(f'{output}: {width}x{height} px; confidence {found.confidence:.2f}')
