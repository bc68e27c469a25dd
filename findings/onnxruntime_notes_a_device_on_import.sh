#!/usr/bin/env bash
# ONNX Runtime notes a device and an event when it is imported, before one can switch that off.
#
# onnxruntime 1.32.0, Python 3.11, Linux. Seen November 2026.
#
# `import onnxruntime` alone writes an identifier of the machine and a database of events into the user's
# cache; the first event names the operating system, the processor and the memory. The events are for its
# makers' server. disable_telemetry_events(), called at once, changes nothing of that: identifier and event
# are there. ORT_DISABLE_TELEMETRY=1 in the environment, before the import, leaves nothing. The build for
# web pages has no telemetry.
# Who ships motion networks with ONNX Runtime: set the variable before the import.
#
# Met by accident, among a test's open files. From memory we would have said: no telemetry outside Windows,
# as its privacy notice had it for years; and that the function that disables events disables them.
#
# Exit 0: as described. Exit 1: it changed. Needs python3.11 and a network for the package; what it runs
# has no network if unshare may take it away.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3.11 -m venv venv
venv/bin/pip install --quiet onnxruntime==1.32.0 numpy==2.4.0
unset ORT_DISABLE_TELEMETRY CI
alone=()
if unshare --net --map-root-user true 2>/dev/null; then alone=(unshare --net --map-root-user); fi

left() { # what a line of Python leaves in an empty cache
  rm -rf cache home
  mkdir cache home
  XDG_CACHE_HOME="$work/cache" HOME="$work/home" "${alone[@]}" venv/bin/python -c "$1"
  (cd cache && find . -type f ! -name '*-wal' ! -name '*-shm' | sort)
}

cat >events.py <<'PY'
import sqlite3
from pathlib import Path

(path,) = Path("cache").rglob("*.db")
payloads = [row[0] for row in sqlite3.connect(path).execute("select payload from events")]
print(len(payloads), "event;", *(word for word in ("cpuModel", "totalMemoryMB", "osDescription")
                                 if any(word.encode() in payload for payload in payloads)))  # fmt: skip
PY

{
  echo "imported:"
  left "import onnxruntime"
  venv/bin/python events.py
  echo "imported and disabled at once:"
  left "import onnxruntime as o; o.disable_telemetry_events()"
  venv/bin/python events.py
  echo "with the variable:"
  ORT_DISABLE_TELEMETRY=1 left "import onnxruntime"
} | tee said.txt

diff said.txt - <<'EXPECTED'
imported:
./Microsoft/DeveloperTools/.onnxruntime/deviceid
./Microsoft/DeveloperTools/.onnxruntime/onnxruntime.db
1 event; cpuModel totalMemoryMB osDescription
imported and disabled at once:
./Microsoft/DeveloperTools/.onnxruntime/deviceid
./Microsoft/DeveloperTools/.onnxruntime/onnxruntime.db
1 event; cpuModel totalMemoryMB osDescription
with the variable:
EXPECTED
echo "As described: imported, it has already noted a device and an event."
