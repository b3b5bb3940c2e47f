"""A calibration file that was changed anyhow is read or refused, never more."""

from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from fisheye_core.errors import FisheyeError
from fisheye_geometry.camera_file import read_camera

FILE = """# A lens.
image_width: 640
image_height: 480
camera_name: left
camera_matrix:
  rows: 3
  cols: 3
  data: [215.7, 0.0, 319.5, 0.0, 215.7, 239.5, 0.0, 0.0, 1.0]
distortion_model: equidistant
distortion_coefficients:
  rows: 1
  cols: 4
  data: [0.0, 0.0, 0.0, 0.0]
"""
PIECES = [
    *('!!bool ', '!!int ""', '!!timestamp x', '!<tag> ', '&a ', '*a', '? ', ': ', '- ', '<<: *a'),
    *('\t', '\n', '\r', '\0', '\ufeff', '\x85', '\u2028', '"\\UFFFFFFFF"', '"\\ud800"', "'", '"'),
    *('[', ']', '{', '}', ',', '#', '|', '>', '%YAML 3.1', '%YAML:1.0', '---', '...', '@', '`'),
    *('1e-05', '1e999', '.nan', '.inf', '9' * 5000, '0x' + 'f' * 5000, '1_0', '1:30', '-'),
    *('[' * 2000, '- ' * 2000, '{a: ' * 500, 'a: ' * 50, '[image]\nwidth\n', 'é', '\ud800'),
]


changes = st.lists(
    st.tuples(
        st.integers(0, len(FILE)),
        st.integers(0, 30),
        st.sampled_from(PIECES) | st.text(max_size=3),
    ),
    min_size=1,
    max_size=4,
)


@settings(max_examples=500, suppress_health_check=list(HealthCheck))
@given(changes=changes)
@example(changes=[(0, len(FILE), '[image]\nwidth\nnan\n[left]\ndistortion\n0 0 0 0 0')])
def test_a_file_that_was_changed_anyhow_is_read_or_refused(tmp_path_factory, changes):
    content = FILE
    for at, count, piece in changes:
        content = content[:at] + piece + content[at + count :]
    path = tmp_path_factory.getbasetemp() / 'fuzzed.yaml'
    path.write_bytes(content.encode(errors='surrogatepass'))
    try:
        lens = read_camera(path).lens
    except FisheyeError as error:
        assert str(error).startswith(str(path))
        assert '\n' not in str(error)
        assert len(str(error)) < len(str(path)) + 1000
        str(error).encode()
    else:
        assert lens.width >= 1
