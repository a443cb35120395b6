# SPDX-License-Identifier: Apache-2.0
"""Helper: a headless Chromium for tests of HTML pages."""

import json
import os
import shutil
from pathlib import Path
from typing import Any

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from waiting import wait_until

CHROMIUMS = ("chromium", "chromium-browser", "google-chrome")
_ARGUMENTS = (
    "--headless",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
)


class Browser:
    """One Chromium; each page is opened anew, in a window of the given size."""

    def __init__(self, profile: Path) -> None:
        chromium = next(filter(None, map(shutil.which, CHROMIUMS)), None)
        driver = shutil.which("chromedriver")
        if chromium is None or driver is None:
            lacking = "chromedriver" if chromium else "Chromium"
            pytest.fail(
                f"{lacking} is not on PATH; run `make chromium`, or install Debian's packages "
                "chromium and chromium-driver",
                pytrace=False,
            )
        options = Options()
        options.binary_location = chromium
        for argument in (*_ARGUMENTS, f"--user-data-dir={profile}"):
            options.add_argument(argument)
        if os.geteuid() == 0:
            options.add_argument("--no-sandbox")  # Chromium's sandbox refuses root
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(driver))

    def open(
        self,
        page: Path,
        *,
        width: int = 1400,
        height: int = 900,
        dark: bool = False,
        reduced_motion: bool = False,
    ) -> None:
        """Open a page and wait until its script has set data-ready."""
        self.command(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 500,
        )
        preferences = {
            "prefers-color-scheme": "dark" if dark else "light",
            "prefers-reduced-motion": "reduce" if reduced_motion else "no-preference",
        }
        features = [{"name": name, "value": value} for name, value in preferences.items()]
        self.command("Emulation.setEmulatedMedia", features=features)
        for kind in ("browser", "performance"):
            self.driver.get_log(kind)  # discards older entries
        self.driver.get("about:blank")
        self.driver.get(page.as_uri())
        ready = "return document.documentElement.dataset.ready === 'yes'"
        wait_until(lambda: bool(self.run(ready)), 30.0)

    def command(self, name: str, **arguments: Any) -> Any:
        return self.driver.execute_cdp_cmd(name, arguments)

    def run(self, script: str, *arguments: Any) -> Any:
        """Run a script and return its result."""
        return self.driver.execute_script(script, *arguments)

    def console_messages(self) -> list[str]:
        """The messages of the console: errors and warnings."""
        return [entry["message"] for entry in self.driver.get_log("browser")]

    def requested(self) -> list[str]:
        """The addresses of all requests since the page was opened."""
        messages = (
            json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")
        )
        return [
            message["params"]["request"]["url"]
            for message in messages
            if message["method"] == "Network.requestWillBeSent"
        ]
