#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes sure that a Chromium and its driver are on PATH: the tests of `mfba report` need them.
# Debian's packages are installed where this user may; otherwise says in one line what to do.
set -euo pipefail

found() {
    command -v chromedriver >/dev/null &&
        { command -v chromium || command -v chromium-browser || command -v google-chrome; } >/dev/null
}

lacking() {
    echo "no Chromium with chromedriver on PATH: $*; install chromium and chromium-driver" \
        "(Debian's names; Ubuntu: chromium-browser and chromium-chromedriver)" >&2
    exit 1
}

found && exit 0
command -v apt-get >/dev/null || lacking "apt-get is not there"
if [ "$(id -u)" -eq 0 ]; then
    root=(env)
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
    root=(sudo -n)
else
    lacking "only root may install it"
fi
echo "installing Debian's chromium and chromium-driver for the tests of the page"
{
    "${root[@]}" apt-get update -qq &&
        "${root[@]}" env DEBIAN_FRONTEND=noninteractive \
            apt-get install -y -qq chromium chromium-driver
} >/dev/null 2>&1 || lacking "apt-get could not install it"
found || lacking "apt-get installed something else"
