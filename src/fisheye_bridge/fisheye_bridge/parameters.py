"""ROS parameters declared from a settings dataclass, checked and kept up to date."""

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from difflib import get_close_matches
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from fisheye_core.errors import FisheyeError
from fisheye_core.settings import Rule, convert, describe_range, rules


class Parameters:
    """The parameters of a node that one settings dataclass describes.

    Attributes
    ----------
    settings
        The current values, an instance of the dataclass.
    """

    def __init__(
        self,
        node: Node,
        settings: type,
        *,
        prefix: str = '',
        on_change: Callable[[Any], None] | None = None,
        **defaults: Any,
    ):
        """Declare the parameters.

        Parameters
        ----------
        node
            The node that gets them.
        settings
            A frozen dataclass of `fisheye_core.settings.setting` fields.
        prefix
            Put before each name, with its dot (`left.`).
        on_change
            Called with the new settings before a live change is taken; a `FisheyeError` that it
            raises refuses the change.
        **defaults
            Instead of the dataclass's own.

        Raises
        ------
        SettingError
            If a value given at start is not possible.
        """
        self._rules = rules(settings)
        self._prefix = prefix
        self._on_change = on_change
        values = {}
        for name, (kind, default, rule) in self._rules.items():
            default = defaults.get(name, default)
            start = list(default) if isinstance(default, tuple) else default
            full_name = prefix + name
            anything = ParameterDescriptor(dynamic_typing=True)
            if node.has_parameter(full_name):  # of settings that were not possible before
                parameter = node.get_parameter(full_name)
            else:
                parameter = node.declare_parameter(full_name, start, anything)
            values[name] = convert(full_name, parameter.value, kind, rule)
            typed = _typed(full_name, values[name])
            if typed.type_ != parameter.type_:
                node.set_parameters([typed])
            # Only now, because rclpy would refuse what is out of range in its own words.
            node.set_descriptor(full_name, _descriptor(rule, kind))
        self.settings = settings(**values)
        # rclpy would hand on what each of several callbacks returns: there is one for all.
        groups = vars(node).setdefault('_parameter_groups', [])
        if not groups:
            node.add_pre_set_parameters_callback(
                lambda given: [_retyped(parameter, groups) for parameter in given]
            )
        groups.append(self)
        node.add_on_set_parameters_callback(self._set)

    def typed(self, parameter: Parameter) -> Parameter | None:
        """Return a parameter with the type of its setting; None if it is none of these.

        Raises
        ------
        SettingError
            If the value is not possible.
        """
        values = self._changes([parameter]).values()
        return next((_typed(parameter.name, value) for value in values), None)

    def _changes(self, parameters: Iterable[Parameter]) -> dict[str, Any]:
        """Return the values that parameters give to these settings, checked."""
        changes = {}
        for parameter in parameters:
            name = parameter.name.removeprefix(self._prefix)
            if parameter.name == self._prefix + name and name in self._rules:
                kind, _, rule = self._rules[name]
                changes[name] = convert(parameter.name, parameter.value, kind, rule)
        return changes

    def _set(self, parameters) -> SetParametersResult:
        try:
            changed = replace(self.settings, **self._changes(parameters))
            # NaN differs from itself, but not in print.
            if repr(changed) != repr(self.settings):
                if self._on_change:
                    self._on_change(changed)
                self.settings = changed
        except FisheyeError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)


def _typed(name: str, value: Any) -> Parameter:
    return Parameter(name, value=list(value) if isinstance(value, tuple) else value)


def _retyped(parameter: Parameter, groups: list[Parameters]) -> Parameter:
    """Pin a parameter to its setting's type: later values must have the type of the default."""
    for group in groups:
        with suppress(FisheyeError):  # refused with its sentence later on
            if typed := group.typed(parameter):
                return typed
    return parameter


def misspelt(node: Node) -> str:
    """Name the parameters that a node was given but does not have; '' if there are none."""
    declared = list(node.get_parameters_by_prefix(''))
    complaints = []
    # rclpy keeps what was given to itself.
    for name in node._parameter_overrides:
        if name not in declared and not name.startswith('qos_overrides.'):
            of_cameras = [other for other in declared if other.endswith(f'.{name}')]
            near = of_cameras or get_close_matches(name, declared, n=1)
            complaints.append(name + (f' (is {" or ".join(near)} meant?)' if near else ''))
    return f'there is no parameter {", ".join(complaints)}' if complaints else ''


def _descriptor(rule: Rule, kind: type) -> ParameterDescriptor:
    """Describe a setting; its type stays open so that a whole number can stand for a float."""
    descriptor = ParameterDescriptor(
        description=rule.help,
        additional_constraints=describe_range(rule),
        read_only=not rule.live,
        dynamic_typing=True,
    )
    if rule.minimum is not None and rule.maximum is not None and not rule.nan:
        low, high = rule.minimum, rule.maximum
        if kind is int:
            descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
        elif kind is float:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(low), to_value=float(high))
            ]
    return descriptor
