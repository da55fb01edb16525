#!/usr/bin/env bash
# MCAP as its users' own readers see it. Arguments: the source's root; flexor.
set -euo pipefail
python=$1/build/python/bin/python
[ -x "$python" ] || { echo "skipped: no build/python (script/bootstrap tests)"; exit 77; }
exec "$python" "$1/host/export/mcap_test.py" "$2"
