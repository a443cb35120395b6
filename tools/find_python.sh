#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Print the first of the given interpreters that can carry the project; else one line, exit 1.
# Each is really run: a name on PATH may be a shim that fails, or lie about its version.
check='
import platform, sys
if not (3, 10) <= sys.version_info[:2] <= (3, 13):
    sys.exit("is Python %d.%d" % sys.version_info[:2])
if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
    sys.exit("is not on Linux x86_64, for which alone there are ROS 2 wheels")
try:
    import ensurepip, venv
except ImportError:
    sys.exit("lacks the venv module (Debian, Ubuntu: apt install python3-venv)")
print(sys.executable)
'
for candidate in "$@"; do
    if ! command -v "$candidate" >/dev/null; then
        reason="is not there"
    elif reason=$("$candidate" -c "$check" 2>&1); then
        echo "${reason:-$(command -v "$candidate")}" # without PATH Python does not know itself
        exit 0
    elif [ -z "$reason" ] || [ "$(printf %s "$reason" | wc -l)" -gt 0 ]; then
        reason="does not run" # a shim's advice, or a traceback
    fi
    said="$said$candidate $reason; "
done
echo "no usable Python: ${said}install Python 3.10 to 3.13 or name it: make PYTHON=/path/to/python3" >&2
exit 1
