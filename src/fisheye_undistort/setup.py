from setuptools import find_packages, setup

package_name = 'fisheye_undistort'

setup(
    name=package_name,
    version='0.2.0',
    maintainer='Fisheye Panorama maintainers',
    maintainer_email='maintainers@fisheye-panorama.example',
    description='Calibration of fisheye lenses, and the correction of their distortion.',
    license='Apache-2.0',
    packages=find_packages(include=[f'{package_name}*']),
    package_data={package_name: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
    ],
    extras_require={'test': ['pytest']},
    entry_points={
        'console_scripts': [
            'calibrate_lens = fisheye_undistort.calibrate_lens:main',
            'undistort_node = fisheye_undistort.undistort_node:main',
        ],
    },
)
