# SPDX-License-Identifier: Apache-2.0
"""Options as ROS parameters: declared with description, type and range, checked as a whole."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from enum import Enum
from typing import Any, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from ...core.errors import ConfigError
from ...core.option_specs import Spec, did_you_mean, override, walk

T = TypeVar("T")


def declare(node: Node, defaults: T, *, read_only: bool = False) -> T:
    """Declare every option of a dataclass as a parameter; return it with the values given.

    Raises ConfigError in one line for a value of the wrong type or out of range.
    """
    found: dict[str, Any] = {}
    for name, default, item in walk(defaults):
        spec: Spec = item.metadata["spec"]
        initial = default.value if isinstance(default, Enum) else default
        descriptor = _descriptor(spec, default, read_only)
        try:
            found[name] = node.declare_parameter(name, initial, descriptor).value
        except InvalidParameterTypeException:
            kind = type(initial).__name__
            hint = " (write 1.0, not 1)" if kind == "float" else ""
            raise ConfigError(
                f"parameter {name}={_given(node, name)!r}: wrong type; give a {kind}{hint}"
            ) from None
        except InvalidParameterValueException as error:
            override(defaults, {name: _given(node, name)})  # raises a clearer message
            raise ConfigError(f"parameter {name}: {error}; {spec.doc}") from None
    return override(defaults, found)


def _given(node: Node, name: str) -> Any:
    """The value given for a parameter; rclpy's exceptions hold it only within a sentence."""
    return plain(node._parameter_overrides[name].value)


def _descriptor(spec: Spec, default: Any, read_only: bool) -> ParameterDescriptor:
    unit = f" [{spec.unit}]" if spec.unit else ""
    choices = ""
    if isinstance(default, Enum):
        choices = f" ({' | '.join(str(member.value) for member in type(default))})"
    descriptor = ParameterDescriptor(description=spec.doc + choices + unit, read_only=read_only)
    if spec.minimum is None and spec.maximum is None:
        return descriptor
    if isinstance(default, float):
        low = -sys.float_info.max if spec.minimum is None else spec.minimum
        high = sys.float_info.max if spec.maximum is None else spec.maximum
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=float(low), to_value=float(high), step=0.0)
        ]
    elif isinstance(default, int) and not isinstance(default, bool):
        low_i = -(2**63) if spec.minimum is None else int(spec.minimum)
        high_i = 2**63 - 1 if spec.maximum is None else int(spec.maximum)
        descriptor.integer_range = [IntegerRange(from_value=low_i, to_value=high_i, step=0)]
    return descriptor


def follow(
    node: Node,
    current: Callable[[], T],
    apply: Callable[[T], None],
    check: Callable[[T], None] = lambda _: None,
) -> None:
    """Let parameters be set at run time: checked as a whole, refused with the reason.

    check raises ConfigError for values that the dataclass itself accepts.
    """

    def changed(parameters: list[Parameter]) -> T:
        known = {name for name, _, _ in walk(current())}
        return override(current(), {p.name: p.value for p in parameters if p.name in known})

    def validate(parameters: list[Parameter]) -> SetParametersResult:
        try:
            check(changed(parameters))
        except ConfigError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(validate)
    # Applied only after all callbacks have accepted the values.
    node.add_post_set_parameters_callback(lambda parameters: apply(changed(parameters)))


def state(node: Node, name: str, value: str, doc: str) -> None:
    """Declare a read-only parameter whose value the node sets; a value given for it is ignored."""
    descriptor = ParameterDescriptor(description=doc, read_only=True)
    node.declare_parameter(name, value, descriptor, ignore_override=True)


def declare_radii(node: Node, default: list[float]) -> list[float]:
    """Declare obstacle_radii_m, the one parameter that is a list; ConfigError if unusable."""
    name = "obstacle_radii_m"
    descriptor = ParameterDescriptor(
        description="radius per obstacle, as obstacles lists them; a single one holds for all [m]",
        read_only=True,
    )
    try:
        radii = list(node.declare_parameter(name, default, descriptor).value)
    except InvalidParameterTypeException:
        raise ConfigError(
            f"parameter {name}={_given(node, name)!r}: wrong type; give [0.3, 0.3]"
        ) from None
    if not all(math.isfinite(r) and r > 0.0 for r in radii):
        raise ConfigError(f"parameter {name}={radii}: give finite radii above 0")
    return radii


def warn_of_unknown(node: Node) -> None:
    """Warn of values given for parameters that the node does not have; rclpy ignores them."""
    declared = list(node._parameters)
    for name in node._parameter_overrides:
        if not node.has_parameter(name):
            node.get_logger().warning(f"{name}: no such parameter; {did_you_mean(name, declared)}")


def values(node: Node) -> dict[str, Any]:
    """All parameters of a node as plain data."""
    found: dict[str, Any] = node.get_parameters_by_prefix("")
    return {name: plain(parameter.value) for name, parameter in found.items()}


def plain(value: Any) -> Any:
    """A parameter's value as plain data: arrays become lists."""
    return list(value) if hasattr(value, "tolist") or isinstance(value, tuple) else value
