# SPDX-License-Identifier: Apache-2.0
"""Import files of other formats: find the format, read, check, and write scenario files."""

from __future__ import annotations

import gzip
import json
import re
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from ...core.errors import ConfigError
from ...core.input_files import MOST_BYTES, at_most, open_input
from ...core.option_specs import did_you_mean
from ..scenario_files import parse_scenario
from .arena import read_arena
from .dynabarn import read_dynabarn
from .gazebo_world import read_world
from .imported import Imported, ImportOptions, Plain, Source
from .ir_sim import read_ir_sim
from .people_recording import read_csv, read_eth_ucy

Reader = Callable[[Source, ImportOptions], Imported]
# name: (how its files end, what it is, its reader)
FORMATS: dict[str, tuple[tuple[str, ...], str, Reader]] = {
    "gazebo": ((".world", ".sdf"), "Gazebo worlds, such as BARN's", read_world),
    "dynabarn": ((".json",), "DynaBARN: worlds of discs on keyframes", read_dynabarn),
    "arena": ((".json",), "Arena scenarios", read_arena),
    "ir-sim": ((".yaml", ".yml"), "IR-SIM worlds", read_ir_sim),
    "csv": ((".csv",), "recorded people: t_s, person, x_m, y_m", read_csv),
    "eth-ucy": ((".txt",), "recorded people of ETH and UCY: frame, person, x, y", read_eth_ucy),
}
_ENDINGS = tuple(ending for endings, _, _ in FORMATS.values() for ending in endings)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportedFile:
    """The result of one file: scenario files as {name: YAML text}, what is lost, or the error."""

    path: Path
    texts: dict[str, str]
    lost: list[str]
    error: str = ""


def files_in(paths: Sequence[Path]) -> list[Path]:
    """The files, and of a directory those whose ending is that of a format, sorted by name.

    Raises ConfigError for a path that does not exist and for a directory without such files.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            inside = sorted(p for p in path.iterdir() if p.is_file() and _ending(p) in _ENDINGS)
            if not inside:
                raise ConfigError(
                    f"{path}: no file in it ends with {', '.join(dict.fromkeys(_ENDINGS))}; "
                    "give files, or another directory"
                )
            found += inside
        elif path.exists():
            found.append(path)
        else:
            raise ConfigError(f"{path}: no such file; give files to import, or a directory")
    return found


def import_files(
    paths: Sequence[Path], options: ImportOptions, format_name: str | None = None
) -> Iterator[ImportedFile]:
    """Import one file after the other; a file that is refused stops none of the others."""
    if format_name is not None and format_name not in FORMATS:
        known = did_you_mean(format_name, list(FORMATS))
        raise ConfigError(f"format {format_name!r}: unknown; {known}")
    taken: set[str] = set()
    for path in paths:
        try:
            imported = _read(path, options, format_name)
            texts = {plain["name"]: _checked(plain, path) for plain in imported.scenarios}
            if again := sorted(taken & set(texts)):
                raise ConfigError(
                    f"name {again[0]!r} is that of another file as well; rename one of them"
                )
        except ConfigError as error:
            yield ImportedFile(path=path, texts={}, lost=[], error=f"{path}: {error}")
            continue
        taken.update(texts)
        yield ImportedFile(path=path, texts=texts, lost=imported.lost)


def _read(path: Path, options: ImportOptions, format_name: str | None) -> Imported:
    text = _text(path)
    reader = FORMATS[format_name or _format_of(path, text)][2]
    name = re.sub(r"[^\w.+-]+", "_", path.name.partition(".")[0], flags=re.ASCII).lstrip(".+-")
    try:
        return reader(Source(text, name[:80] or "imported", path.parent), options)
    except RecursionError:
        raise ConfigError("nested too deeply; mend the file") from None


def _text(path: Path) -> str:
    """The text of a file, also .gz. Raises ConfigError where it is too large or no text."""
    try:
        with open_input(path) as file:
            plain = gzip.GzipFile(fileobj=file) if path.suffix == ".gz" else file
            return at_most(plain.read(MOST_BYTES + 1), path, MOST_BYTES).decode("utf-8-sig")
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise ConfigError(f"{reason}; give a readable file, or a part of it") from None


def _ending(path: Path) -> str:
    return Path(path.stem).suffix.lower() if path.suffix == ".gz" else path.suffix.lower()


def _format_of(path: Path, text: str) -> str:
    ending = _ending(path)
    names = [name for name, (endings, _, _) in FORMATS.items() if ending in endings]
    if len(names) > 1:
        return _by_content(text, names)
    if not names:
        raise ConfigError(
            f"ending {ending!r} is that of no format; give --format, one of {', '.join(FORMATS)}"
        )
    return names[0]


def _by_content(text: str, names: Sequence[str]) -> str:
    """The format of a JSON file: DynaBARN's keyframes have a key of their own."""
    try:
        data: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"not JSON ({error}); mend the file") from None
    of_dynabarn = isinstance(data, dict) and "keyframes" in data
    return names[0] if of_dynabarn else names[1]


def _checked(plain: Plain, path: Path) -> str:
    """The YAML text of a scenario that load_scenario accepts. Raises ConfigError."""
    text = f"# imported by `mfba import` from {path.name}\n{_yaml(plain)}"
    parse_scenario(text, plain["name"])
    return text


def _yaml(plain: Plain) -> str:
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)  # in C where it is built
    text: str = yaml.dump(plain, Dumper=dumper, sort_keys=False, default_flow_style=None, width=95)
    return text
