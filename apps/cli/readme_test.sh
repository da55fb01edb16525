#!/usr/bin/env bash
# The README's quick starts work pasted as they stand, in an empty folder, and their model moves the hand; `live` is what the tests of the page start.
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

[ -x "$(dirname "$1")/flexor-cosim" ] || exit 0  # the package flexor alone

# The model of held poses moves the bionic hand, both boards simulated, to its ends within 3 degrees.
awk 'BEGIN { print "t_s,thumb_deg,index_deg,middle_deg,ring_deg,pinky_deg"
  for (k = 0; k <= 600; k++) { c = (k - 300) / 50; c = c < 0 ? 0 : c > 1 ? 1 : c; f = 28 + 85 * c
    printf "%.2f,%.2f,%.2f,%.2f,%.2f,%.2f\n", k / 100, 90 + 80 * c, f, f, f, f } }' >hold.csv
flexor experiment --trials 1 --compensators hand.json --gestures hold.csv --engine avr --out boards/ >/dev/null
awk -F, 'function far(got, want) { return got - want > 3 || want - got > 3 }
  NR > 1 && ($1 > 2 && $1 < 3 || $1 > 5) { rows++; fist = $1 > 5
    for (i = 3; i <= 11; i += 2) if (far($i, i == 3 ? (fist ? 170 : 90) : (fist ? 113 : 28))) { print "off: " $0; exit 1 } }
  END { if (rows < 30) exit 1 }' boards/traces/*.csv
