from setuptools import setup

package_name = 'fisheye_geometry'

setup(
    name=package_name,
    version='0.2.0',
    maintainer='Fisheye Panorama maintainers',
    maintainer_email='maintainers@fisheye-panorama.example',
    description='Fisheye lenses, projection surfaces and the remap tables between them. No ROS.',
    license='Apache-2.0',
    packages=[package_name],
    package_data={package_name: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
    ],
    extras_require={'test': ['hypothesis', 'pytest']},
)
