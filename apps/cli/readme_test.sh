#!/usr/bin/env bash
# The README's quick starts work pasted as they stand, in an empty folder; `live` is what the tests of the page start.
# Usage: readme_test.sh PROGRAM README
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
awk '/^```/ { fenced = !fenced; next } fenced && /^flexor / && !/ live /' "$2" >"$folder/lines.sh"
[ "$(grep -c . "$folder/lines.sh")" = 7 ] || { echo "seven lines were expected"; exit 1; }
PATH="$(dirname "$1"):$PATH"
cd "$folder"
bash -e lines.sh
[ -s vr/glove.hex ] && [ "$(wc -l <angles.csv)" -gt 1000 ] && [ -s report/report.html ] && [ -s paper/report.html ]
