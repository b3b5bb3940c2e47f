"""Parameters: declared with descriptors; what is clear is taken, the rest refused by name."""

from dataclasses import dataclass
from math import isnan, nan

import pytest
import rclpy
import yaml
from rclpy.node import Node
from rclpy.parameter import Parameter

from fisheye_bridge.parameters import Parameters, misspelt
from fisheye_core.errors import OverlapError, SettingError
from fisheye_core.settings import rules, setting


@dataclass(frozen=True)
class NodeSettings:
    """One setting of each kind."""

    rate_hz: float = setting(30.0, 'Frames a second.', minimum=0.1, maximum=1000.0, live=True)
    source: str = setting('synthetic', 'Where pictures come from.')
    blend: str = setting('feather', 'How.', choices=('none', 'feather'), live=True)
    offset_px: tuple[float, ...] = setting((nan,), 'Offset.', nan=True, live=True)
    angle_deg: float = setting(nan, 'Angle.', minimum=-90.0, maximum=90.0, nan=True, live=True)
    count: int = setting(50, 'How many.', minimum=1, maximum=100, live=True)
    views: tuple[str, ...] = setting((), 'Names.', live=True)


@pytest.fixture
def make_node():
    context = rclpy.Context()
    rclpy.init(context=context)
    nodes = []

    def make(**overrides):
        given = [Parameter(name, value=value) for name, value in overrides.items()]
        node = Node(f'parameters_{len(nodes)}', context=context, parameter_overrides=given)
        nodes.append(node)
        return node

    yield make
    for node in nodes:
        node.destroy_node()
    rclpy.shutdown(context=context)


def test_defaults_and_descriptors(make_node):
    node = make_node()
    settings = Parameters(node, NodeSettings).settings
    assert (settings.rate_hz, settings.source, settings.blend) == (30.0, 'synthetic', 'feather')
    assert isnan(settings.offset_px[0])
    rate = node.describe_parameter('rate_hz')
    assert rate.description == 'Frames a second.'
    assert (rate.floating_point_range[0].from_value, rate.read_only) == (0.1, False)
    assert node.describe_parameter('source').read_only
    assert node.describe_parameter('blend').additional_constraints == 'one of none, feather'


def test_what_is_clear_is_taken(make_node):
    settings = Parameters(make_node(rate_hz=15, source=0, offset_px=545), NodeSettings).settings
    assert (settings.rate_hz, settings.source, settings.offset_px) == (15.0, '0', (545.0,))


@pytest.mark.parametrize(
    ('overrides', 'words'),
    [
        ({'rate_hz': 5000.0}, 'rate_hz is 5000; expected 0.1 to 1000'),
        ({'rate_hz': 5000}, 'rate_hz is 5000; expected 0.1 to 1000'),
        ({'rate_hz': 'fast'}, "rate_hz is 'fast'; expected a number"),
        ({'blend': 'soft'}, "blend is 'soft'; expected one of none, feather"),
    ],
)
def test_a_bad_start_is_refused_by_name(make_node, overrides, words):
    with pytest.raises(SettingError, match=words):
        Parameters(make_node(**overrides), NodeSettings)


def change(node, name, value):
    return node.set_parameters([Parameter(name, value=value)])[0]


def test_live_changes_apply_and_bad_ones_do_not(make_node):
    node, seen = make_node(), []
    parameters = Parameters(node, NodeSettings, on_change=lambda new: seen.append(new.blend))
    assert change(node, 'blend', 'none').successful
    assert parameters.settings.blend == 'none'
    for name, value, words in [
        ('blend', 'soft', "'soft'; expected one of"),
        ('rate_hz', 0, '0; expected 0.1 to 1000'),
        ('source', 'x', 'read-only'),
    ]:
        result = change(node, name, value)
        assert not result.successful
        assert words in result.reason
    assert parameters.settings.rate_hz == 30.0
    assert seen == ['none']
    assert change(node, 'offset_px', nan).successful
    assert seen == ['none'], 'NaN for NaN is no change'


def test_a_parameter_keeps_its_type(make_node):
    node = make_node(rate_hz=15, source=0, offset_px=545)
    Parameters(node, NodeSettings, prefix='other.')
    Parameters(node, NodeSettings)
    kinds = {'rate_hz': Parameter.Type.DOUBLE, 'source': Parameter.Type.STRING}
    kinds['offset_px'] = Parameter.Type.DOUBLE_ARRAY
    assert {name: node.get_parameter(name).type_ for name in kinds} == kinds
    assert change(node, 'rate_hz', 20).successful
    assert change(node, 'count', 5.0).successful
    assert change(node, 'offset_px', 7).successful
    assert node.get_parameter('count').value == 5
    assert node.get_parameter('count').type_ == Parameter.Type.INTEGER
    assert {name: node.get_parameter(name).type_ for name in kinds} == kinds
    assert change(node, 'use_sim_time', True).successful


def test_what_was_dumped_can_be_loaded(make_node):
    node = make_node()
    parameters = Parameters(node, NodeSettings)
    for name, (_, default, rule) in rules(NodeSettings).items():
        if rule.live:
            value = list(default) if isinstance(default, tuple) else default
            # `ros2 param dump` writes YAML, `load` reads it and hands on its words as YAML again.
            loaded = yaml.safe_load(str(yaml.safe_load(yaml.safe_dump(value))))
            assert change(node, name, loaded).successful, name
            assert repr(getattr(parameters.settings, name)) == repr(default)
            assert node.get_parameter(name).type_ == Parameter.Type.from_parameter_value(value)


def test_a_list_of_nothing_is_refused(make_node):
    node = make_node()
    Parameters(node, NodeSettings)
    result = change(node, 'offset_px', [])
    assert (result.successful, result.reason) == (
        False,
        'offset_px is empty; expected at least one value',
    )
    assert change(node, 'views', []).successful


def test_the_node_may_refuse_with_a_sentence(make_node):
    def refuse(settings):
        raise OverlapError('that does not fit')

    node = make_node()
    parameters = Parameters(node, NodeSettings, on_change=refuse)
    assert change(node, 'blend', 'none').reason == 'that does not fit'
    assert parameters.settings.blend == 'feather'


def test_prefixes_keep_two_sets_apart(make_node):
    node = make_node(**{'left.source': 'a.png'})
    left = Parameters(node, NodeSettings, prefix='left.')
    right = Parameters(node, NodeSettings, prefix='right.', rate_hz=10.0)
    assert (left.settings.source, right.settings.source) == ('a.png', 'synthetic')
    assert right.settings.rate_hz == 10.0
    assert change(node, 'left.blend', 'none').successful
    assert (left.settings.blend, right.settings.blend) == ('none', 'feather')


def test_a_bad_start_can_be_put_right(make_node):
    node = make_node(**{'front.rate_hz': 5000.0})
    for _ in range(2):
        with pytest.raises(SettingError, match=r'front\.rate_hz is 5000'):
            Parameters(node, NodeSettings, prefix='front.')
    node.set_parameters([Parameter('front.rate_hz', value=20.0)])
    assert Parameters(node, NodeSettings, prefix='front.').settings.rate_hz == 20.0


def test_what_nobody_declared_is_named(make_node):
    node = make_node(
        **{
            'left.sources': 0,
            'left.rate_hz': 5,
            'source': 5,
            'xyz': 1,
            'use_sim_time': False,
            'qos_overrides./parameter_events.publisher.depth': 5,
        }
    )
    Parameters(node, NodeSettings, prefix='left.')
    Parameters(node, NodeSettings, prefix='right.')
    assert misspelt(node) == (
        'there is no parameter left.sources (is left.source meant?), '
        'source (is left.source or right.source meant?), xyz'
    )
    assert misspelt(make_node(use_sim_time=False)) == ''
