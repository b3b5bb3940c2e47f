from setuptools import setup

package_name = 'fisheye_testing'

setup(
    name=package_name,
    version='0.2.0',
    maintainer='Fisheye Panorama maintainers',
    maintainer_email='maintainers@fisheye-panorama.example',
    description='Rigs of real processes, watchers and odd inputs, for the tests of all packages.',
    license='Apache-2.0',
    packages=[package_name],
    package_data={package_name: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
    ],
)
