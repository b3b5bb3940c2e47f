from glob import glob

from setuptools import find_packages, setup

package_name = 'panorama_stitch'

setup(
    name=package_name,
    version='0.2.0',
    maintainer='Fisheye Panorama maintainers',
    maintainer_email='maintainers@fisheye-panorama.example',
    description='Overlap calibration and live stitching of fisheye cameras to one panorama.',
    license='Apache-2.0',
    packages=find_packages(include=[f'{package_name}*']),
    package_data={package_name: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        (f'share/{package_name}/launch', glob('launch/*.launch.py')),
        (f'share/{package_name}/rviz', glob('rviz/*.rviz')),
        (f'share/{package_name}/foxglove', glob('foxglove/*.json')),
        (f'share/{package_name}/config', ['config/panorama.yaml']),
        (f'share/{package_name}/config/calibration', glob('config/calibration/*')),
    ],
    extras_require={'test': ['hypothesis', 'pytest']},
    entry_points={
        'console_scripts': [
            'calibrate_rig = panorama_stitch.turn.calibrate_rig:main',
            'panorama_node = panorama_stitch.nodes.panorama_node:main',
            'stitch_node = panorama_stitch.nodes.stitch_node:main',
        ],
    },
)
