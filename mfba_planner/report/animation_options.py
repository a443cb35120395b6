# SPDX-License-Identifier: Apache-2.0
"""Options of an animation; apart from its code, so that --help need not load Pillow."""

from __future__ import annotations

from dataclasses import dataclass

from mfba_planner.core.errors import ConfigError


@dataclass(frozen=True, slots=True, kw_only=True)
class AnimationOptions:
    """Frames per second, simulated seconds per second, width in pixels, size limit in bytes."""

    fps: float = 12.0
    speed: float = 3.0
    width_px: int = 640
    max_bytes: int = 1_500_000

    def __post_init__(self) -> None:
        """Raise ConfigError for a number out of its range."""
        for option, value, low, high in (
            ("fps", self.fps, 1, 50),
            ("speed", self.speed, 0.01, 1000),
            ("width", self.width_px, 160, 1920),
            ("max-bytes", self.max_bytes, 1000, 1_000_000_000),
        ):
            if not low <= value <= high:
                given = f"{value:g}" if isinstance(value, float) else value
                raise ConfigError(
                    f"--{option}={given}: out of range; give a number from {low} to {high}"
                )
