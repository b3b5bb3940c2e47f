from setuptools import setup

package_name = 'panorama_viewer'

setup(
    name=package_name,
    version='0.2.0',
    maintainer='Fisheye Panorama maintainers',
    maintainer_email='maintainers@fisheye-panorama.example',
    description='The live panorama in a browser, and saved to files that other programs read.',
    license='Apache-2.0',
    packages=[package_name],
    package_data={package_name: ['py.typed', 'web/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
    ],
    extras_require={'test': ['pytest']},
    entry_points={
        'console_scripts': [
            'snapshot = panorama_viewer.snapshot_node:main',
            'viewer_node = panorama_viewer.viewer_node:main',
        ],
    },
)
