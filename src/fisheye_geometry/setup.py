from setuptools import setup

package_name = 'fisheye_geometry'

setup(
    name=package_name,
    version='0.1.0',
    packages=[package_name],
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
    ],
    extras_require={'test': ['hypothesis', 'pytest']},
)
