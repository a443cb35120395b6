# SPDX-License-Identifier: Apache-2.0
"""Recordings of people: CSV tables (t_s, person, x_m, y_m), and ETH/UCY text files.

The text files of the ETH and UCY data sets hold a line per frame and person: frame, person, x, y;
or, as ETH's obsmat.txt, frame, person, x, z, y and velocities. Frames have no time of their own:
the recording's frames per second are an option.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable

import numpy as np

from ...core.errors import ConfigError
from .crossings import Track, crossings_of
from .imported import Imported, ImportOptions, Source, number

COLUMNS = ("t_s", "person", "x_m", "y_m")
_PLAIN, _OBSMAT = 4, 8  # columns of a text file
MOST_SAMPLES = 2_000_000

Sample = tuple[str, float, float, float]  # person, s, m, m


def read_csv(source: Source, options: ImportOptions) -> Imported:
    """Crossings among the people of a CSV table. Raises ConfigError."""
    return crossings_of(source.name, csv_tracks(source.text), options)


def read_eth_ucy(source: Source, options: ImportOptions) -> Imported:
    """Crossings among the people of an ETH/UCY text file. Raises ConfigError."""
    return crossings_of(source.name, eth_ucy_tracks(source.text, options.fps), options)


def csv_tracks(text: str) -> list[Track]:
    """The people of a CSV table. Raises ConfigError, naming the line."""
    reader = csv.DictReader(text.splitlines())
    try:
        names = reader.fieldnames or ()
        if missing := [name for name in COLUMNS if name not in names]:
            raise ConfigError(f"no column {missing[0]}; give {', '.join(COLUMNS)}")
        return tracks_of(
            (
                row["person"],
                _value(row["t_s"], line),
                _value(row["x_m"], line),
                _value(row["y_m"], line),
            )
            for line, row in enumerate(reader, start=2)
        )
    except csv.Error as error:
        raise ConfigError(f"not a CSV table ({error}); give {', '.join(COLUMNS)}") from None


def eth_ucy_tracks(text: str, fps: float) -> list[Track]:
    """The people of an ETH/UCY text file. Raises ConfigError, naming the line."""

    def samples() -> Iterable[Sample]:
        for line, words in enumerate(map(str.split, text.splitlines()), start=1):
            if not words:
                continue
            if len(words) not in (_PLAIN, _OBSMAT):
                raise ConfigError(
                    f"line {line}: {len(words)} columns; give frame, person, x, y "
                    "(or the eight of obsmat.txt)"
                )
            frame, _, x, *rest = (_value(word, line) for word in words)
            yield words[1], frame / fps, x, rest[0] if len(words) == _PLAIN else rest[1]

    return tracks_of(samples())


def tracks_of(samples: Iterable[Sample]) -> list[Track]:
    """Samples grouped by person, each sorted by time. Raises ConfigError.

    Refused are stamps that go back, a person at two places at once, and nobody with two samples.
    """
    found: dict[str, list[tuple[float, float, float]]] = {}
    for count, (person, t, x, y) in enumerate(samples):
        if count >= MOST_SAMPLES:
            raise ConfigError(f"more than {MOST_SAMPLES} samples; take a part of the recording")
        own = found.setdefault(person, [])
        if own and t <= own[-1][0]:
            raise ConfigError(
                f"person {person}: time {t:g} s after {own[-1][0]:g} s; sort the recording by "
                "time, one sample for each"
            )
        own.append((t, x, y))
    tables = [np.array(rows) for rows in found.values() if len(rows) > 1]
    if not tables:
        raise ConfigError("no person with two samples; give a recording of people")
    return [(table[:, 0], table[:, 1:]) for table in tables]


def _value(word: object, line: int) -> float:
    try:
        return number(word, "value")
    except ConfigError as error:
        raise ConfigError(f"line {line}: {error}") from None
