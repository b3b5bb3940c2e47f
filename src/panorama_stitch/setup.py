from glob import glob

from setuptools import find_packages, setup

package_name = 'panorama_stitch'

setup(
    name=package_name,
    version='0.1.0',
    packages=find_packages(include=[f'{package_name}*']),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        (f'share/{package_name}/launch', glob('launch/*.launch.py')),
        (f'share/{package_name}/rviz', glob('rviz/*.rviz')),
        (f'share/{package_name}/foxglove', glob('foxglove/*.json')),
        (f'share/{package_name}/hook', ['hook/middleware.dsv']),
        # The rig's files stay at the top of the checkout, where a user looks for them.
        (f'share/{package_name}/config', glob('../../config/*.yaml') + glob('../../config/*.xml')),
        (f'share/{package_name}/config/calibration', glob('../../config/calibration/*.yaml')),
    ],
    extras_require={'test': ['hypothesis', 'pytest']},
    entry_points={
        'console_scripts': [
            'panorama_node = panorama_stitch.nodes.panorama_node:main',
            'stitch_node = panorama_stitch.nodes.stitch_node:main',
        ],
    },
)
