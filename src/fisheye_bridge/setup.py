from glob import glob

from setuptools import setup

package_name = 'fisheye_bridge'

setup(
    name=package_name,
    version='0.2.0',
    maintainer='Fisheye Panorama maintainers',
    maintainer_email='maintainers@fisheye-panorama.example',
    description='ROS 2 messages to arrays and back, parameters, QoS, diagnostics, running a node.',
    license='Apache-2.0',
    packages=[package_name],
    package_data={package_name: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        (f'share/{package_name}/config', glob('config/*.xml')),
        (f'share/{package_name}/hook', ['hook/environment.dsv']),
    ],
    extras_require={'test': ['pytest']},
)
