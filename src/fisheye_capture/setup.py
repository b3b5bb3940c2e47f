from setuptools import setup

package_name = 'fisheye_capture'

setup(
    name=package_name,
    version='0.2.0',
    maintainer='Fisheye Panorama maintainers',
    maintainer_email='maintainers@fisheye-panorama.example',
    description='Cameras as ROS 2 nodes: devices, files, network streams, a synthetic scene.',
    license='Apache-2.0',
    packages=[package_name],
    package_data={package_name: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
    ],
    extras_require={'test': ['pytest']},
    entry_points={
        'console_scripts': [
            'capture_node = fisheye_capture.capture_node:main',
        ],
    },
)
