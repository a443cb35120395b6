# SPDX-License-Identifier: Apache-2.0
"""An animated WebP or GIF of a run: frame times, encoding within a size limit."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from PIL import Image

from mfba_planner.core.errors import ConfigError

from . import style
from .animation_frames import FrameDrawer, Runs
from .animation_options import AnimationOptions
from .run_events import span_s

# by suffix: Pillow's name, unit of a frame's duration (ms), options; both without loss
_FORMATS: dict[str, tuple[str, int, dict[str, Any]]] = {
    ".webp": ("WEBP", 1, {"lossless": True, "quality": 70, "method": 4, "minimize_size": True}),
    ".gif": ("GIF", 10, {"optimize": False}),
}
SUFFIXES = tuple(_FORMATS)
LAST_FRAME_MS = 1500
MOST_PIXELS = 200_000_000  # of all frames together: 0.6 GB of memory
_PALETTES = ((128, 16), (64, 24), (32, 32), (16, 48))  # colours, and how far apart at least
_PLAIN = Image.Dither.NONE
_SAMPLES = 8  # frames that the palette is taken from
_THINNING = (1, 2, 3, 4)  # every frame, every second one, ...


def animation_bytes(
    runs: Runs,
    roster: Sequence[str],
    suffix: str,
    options: AnimationOptions,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> bytes:
    """Draw and encode the runs of one world; the same input gives the same bytes.

    roster names all robots of a fleet, of which runs are some; progress receives the number of
    frames drawn and their total. Raises ConfigError for too many frames, or no size that fits.
    """
    times_s = _frame_times(runs, options)
    with style.context():
        drawer = FrameDrawer(runs, roster, options.width_px)
        _check_pixels(len(times_s), drawer.size_px, options)
        images = []
        for time_s in times_s:
            images.append(Image.fromarray(drawer.draw(time_s)))
            progress(len(images), len(times_s))
    return encode(images, suffix, options)


def encode(images: Sequence[Image.Image], suffix: str, options: AnimationOptions) -> bytes:
    """Encode frames with as many colours as fit into options.max_bytes; ConfigError if none do."""
    form, unit_ms, looks = _FORMATS[suffix]
    smallest = 0
    for every in _THINNING:
        kept = _thinned(images, every)
        durations = _durations_ms(len(kept), every / options.fps, unit_ms)
        for colours, apart in _PALETTES:
            palette = _palette(kept, colours, apart)
            first, *others = [image.quantize(palette=palette, dither=_PLAIN) for image in kept]
            buffer = io.BytesIO()
            first.save(
                buffer, form, save_all=True, append_images=others, duration=durations, loop=0,
                **looks,
            )  # fmt: skip
            smallest = buffer.tell()
            if smallest <= options.max_bytes:
                return buffer.getvalue()
    raise ConfigError(
        f"--max-bytes={options.max_bytes}: too few, {smallest} bytes with fewest colours and "
        "frames; give more, a smaller --width or a higher --speed"
    )


def _palette(images: Sequence[Image.Image], colours: int, apart: int) -> Image.Image:
    """The commonest colours of some frames that differ by `apart` (of 255) or more."""
    spread = np.linspace(0, len(images) - 1, _SAMPLES).round().astype(int).tolist()
    pixels = np.concatenate([np.asarray(images[index]).reshape(-1, 3) for index in spread])
    codes, counts = np.unique(pixels @ np.array([1 << 16, 1 << 8, 1]), return_counts=True)
    codes = codes[np.lexsort((codes, -counts))]
    rgb = np.stack([codes >> 16, codes >> 8 & 255, codes & 255], axis=1)
    chosen: list[int] = []
    while len(rgb) and len(chosen) < 3 * colours:
        chosen += rgb[0].tolist()
        rgb = rgb[np.abs(rgb - rgb[0]).max(axis=1) >= apart]
    palette = Image.new("P", (1, 1))
    palette.putpalette(chosen)
    return palette


def _thinned(images: Sequence[Image.Image], every: int) -> list[Image.Image]:
    """Every so many frames, and the last."""
    return [*images[:-1][::every], images[-1]]


def _durations_ms(count: int, frame_s: float, unit_ms: int) -> list[int]:
    """How long each frame is shown, rounded so that errors do not add up."""
    ends = [unit_ms * round(1000.0 * k * frame_s / unit_ms) for k in range(count)]
    return [*np.diff(ends).tolist(), LAST_FRAME_MS]


def _frame_times(runs: Runs, options: AnimationOptions) -> list[float]:
    """Simulated times of the frames, evenly apart; the last one is that of the last tick."""
    spans = [span_s(episode) for _, episode in runs]
    start, end = min(a for a, _ in spans), max(b for _, b in spans)
    step = options.speed / options.fps
    count = math.ceil((end - start) / step - 1e-9)
    return [*(start + k * step for k in range(count)), end]


def _check_pixels(count: int, size_px: tuple[int, int], options: AnimationOptions) -> None:
    width, height = size_px
    most = MOST_PIXELS // (width * height)
    if count > most:
        speed = options.speed * count / max(1, most - 2)
        raise ConfigError(
            f"{count} frames of {width} x {height} pixels: at most {most} of this size; "
            f"give --speed={math.ceil(speed)} or a smaller --width"
        )
