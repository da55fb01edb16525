#!/usr/bin/env bash
# Exports as their users' own readers see them. Arguments: mcap, mot or bids; the source's root; flexor.
set -euo pipefail
python=$2/build/python/bin/python
[ -x "$python" ] || { echo "skipped: no build/python (script/bootstrap tests)"; exit 77; }
exec "$python" "$2/host/export/readers_test.py" "$1" "$3"
