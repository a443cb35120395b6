#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# usage: colcon_check.sh VENV; builds the tree with VENV's colcon, both ways, and checks what
# `ros2 run` and `ros2 launch` would find. Writes below build/colcon only.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
tree=$PWD
venv=$(cd "$1" && pwd)
programs="launcher mfba planner recorder replay virtual_sensor world_sim"

fail() {
    echo "colcon_check: $*" >&2
    exit 1
}

build() { # MODE [colcon build option...]
    local base=build/colcon/$1
    "$venv/bin/colcon" --log-base "$base/log" build --paths . \
        --build-base "$base/build" --install-base "$base/install" "${@:2}"
}

check() { # MODE
    local prefix=$tree/build/colcon/$1/install/mfba_planner
    local found
    found=$(cd "$prefix/lib/mfba_planner" && find . -maxdepth 1 -executable ! -type d -printf '%f\n' |
        sort | xargs)
    [ "$found" = "$programs" ] || fail "$1: lib/mfba_planner holds: $found; expected: $programs"
    [ -n "$(find "$prefix/share/mfba_planner/" -name '*launch.py')" ] || fail "$1: no launch file"
    ( # outside the tree, so that only the installed package can be imported
        cd /
        set +u
        source "$prefix/../setup.bash"
        set -u
        PREFIX=$prefix BASE=$tree/build/colcon/$1 "$venv/bin/python" - <<'PYTHON'
import os

from ament_index_python import get_package_prefix, get_package_share_directory

import mfba_planner
from mfba_planner.simulation.run_episode import run
from mfba_planner.report.html.page import page
from mfba_planner.core.shipped_files import scenario_names
from mfba_planner.scenarios.scenario_files import load_scenario

assert mfba_planner.__file__.startswith(os.environ["BASE"]), mfba_planner.__file__
assert get_package_prefix("mfba_planner") == os.environ["PREFIX"]
share = get_package_share_directory("mfba_planner")
assert os.path.isfile(f"{share}/package.xml"), share
assert "case1" in scenario_names()
assert page([("run", run(load_scenario("empty")))]), "parts of the page are missing"
PYTHON
        "$prefix/lib/mfba_planner/mfba" --help >/dev/null
    )
    echo "colcon_check: $1: executables, ament_index and config found"
}

rm -rf build/colcon
build copy
check copy
build symlink --symlink-install
check symlink

# All tests are `make test`'s business; here it is colcon's finding and counting them.
"$venv/bin/colcon" --log-base build/colcon/copy/log test --paths . \
    --build-base build/colcon/copy/build --install-base build/colcon/copy/install \
    --pytest-args test/test_package.py
results=$("$venv/bin/colcon" test-result --verbose --test-result-base build/colcon/copy/build) ||
    fail "$results"
echo "colcon_check: colcon test: $results"
[[ $results =~ Summary:\ [1-9] ]] || fail "colcon test ran no test"
