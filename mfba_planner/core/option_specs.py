# SPDX-License-Identifier: Apache-2.0
"""Options as dataclass fields with type, range, unit and help text; checking and overriding."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import Field, dataclass, field, fields, is_dataclass, replace
from difflib import get_close_matches
from enum import Enum
from typing import Any, TypeVar

from .errors import ConfigError

T = TypeVar("T")
Scalar = bool | int | float | str


@dataclass(frozen=True, slots=True, kw_only=True)
class Spec:
    """Help text, unit and inclusive range of an option."""

    doc: str
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None


def option(
    default: Any,
    doc: str,
    *,
    unit: str = "",
    minimum: float | None = None,
    maximum: float | None = None,
) -> Any:
    """Declare a dataclass field with its Spec; the default's type is the option's type."""
    spec = Spec(doc=doc, unit=unit, minimum=minimum, maximum=maximum)
    return field(default=default, metadata={"spec": spec})


def check(instance: Any) -> None:
    """Check every option of a dataclass against its Spec; call it from __post_init__.

    Integers given for a float become floats and names given for an Enum become members.
    Raises ConfigError naming the option, the value and the remedy.
    """
    for item in fields(instance):
        spec = item.metadata.get("spec")
        if spec is not None:
            value = _checked(item.name, getattr(instance, item.name), item.default, spec)
            object.__setattr__(instance, item.name, value)


def _checked(name: str, value: Any, default: Any, spec: Spec) -> Any:
    """Return the value in the default's type, or raise ConfigError."""
    if isinstance(default, Enum):
        return _member(name, value, type(default))
    if isinstance(default, float) and isinstance(value, int | float) and type(value) is not bool:
        value = _as_float(value)
    if type(value) is not type(default):
        kind = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}
        raise ConfigError(f"{name}={value!r}: give {kind.get(type(default), 'another type')}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(f"{name}={value}: not finite; give {_interval(spec)}")
    too_low = spec.minimum is not None and value < spec.minimum
    too_high = spec.maximum is not None and value > spec.maximum
    if too_low or too_high:
        raise ConfigError(f"{name}={value}: out of range; give {_interval(spec)}")
    return value


def require_range(
    name: str, value: float, low: float, high: float, unit: str = "", *, above: bool = False
) -> None:
    """Raise ConfigError, with the range, for a value not in [low, high] or, if above, (low, high].

    For values that belong to no dataclass of options.
    """
    if (low < value if above else low <= value) and value <= high:
        return
    given, least, most = (f"{v:g}" if isinstance(v, float) else v for v in (value, low, high))
    interval = f"more than {least}, at most {most}" if above else f"{least} to {most}"
    raise ConfigError(f"{name}={given}: out of range; give {f'{interval} {unit}'.rstrip()}")


def _as_float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:  # a whole number of more than 308 digits
        return math.inf


def _member(name: str, value: Any, kind: type[Enum]) -> Enum:
    try:
        return kind(value)
    except ValueError:
        names = ", ".join(str(member.value) for member in kind)
        raise ConfigError(f"{name}={value!r}: unknown; choose one of {names}") from None


def _interval(spec: Spec) -> str:
    low = "-inf" if spec.minimum is None else f"{spec.minimum:g}"
    high = "inf" if spec.maximum is None else f"{spec.maximum:g}"
    return f"a value in [{low}, {high}]{' ' + spec.unit if spec.unit else ''}"


def walk(instance: Any, prefix: str = "") -> Iterator[tuple[str, Any, Field[Any]]]:
    """Yield (dotted name, value, field) of every option, nested dataclasses flattened."""
    for item in fields(instance):
        value = getattr(instance, item.name)
        if is_dataclass(value):
            yield from walk(value, f"{prefix}{item.name}.")
        elif "spec" in item.metadata:
            yield prefix + item.name, value, item


def flatten(instance: Any) -> dict[str, Scalar]:
    """Return {dotted name: plain value}; Enums become their value."""
    return {name: v.value if isinstance(v, Enum) else v for name, v, _ in walk(instance)}


def override(instance: T, changes: Mapping[str, Any]) -> T:
    """Return a copy with dotted names changed and everything checked again.

    Raises ConfigError for an unknown name (with the nearest known one) or a refused value.
    """
    nested: dict[str, dict[str, Any]] = {}
    direct: dict[str, Any] = {}
    known = [name for name, _, _ in walk(instance)]
    for name, value in changes.items():
        if name not in known:
            raise ConfigError(f"{name}: unknown option; {did_you_mean(name, known)}")
        head, _, rest = name.partition(".")
        if rest:
            nested.setdefault(head, {})[rest] = value
        else:
            direct[name] = value
    for head, changed in nested.items():
        direct[head] = override(getattr(instance, head), changed)
    return replace(instance, **direct)  # type: ignore[type-var]


def did_you_mean(word: str, known: list[str]) -> str:
    """Suggest the nearest known word, or list them all."""
    near = get_close_matches(word, known, n=1, cutoff=0.5)
    return f"did you mean {near[0]!r}?" if near else f"known: {', '.join(sorted(known))}"
