#!/usr/bin/env bash
# What a page marks as `sh run` works pasted as it stands, in an empty folder; and the README's model of held poses moves the hand.
# Usage: lines_test.sh PROGRAM ROOT README|TUTORIAL
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
awk '/^```/ { runs = $0 == "```sh run"; next } runs' "$(find "$2/README.md" "$2/docs/tutorials" -name "$3.md")" >"$folder/lines.sh"
[ "$(grep -c '^flexor ' "$folder/lines.sh")" -ge 4 ] || { echo "four commands were expected"; exit 1; }
PATH="$(dirname "$1"):$PATH"
cd "$folder"
bash -e -x lines.sh
[ "$3" = README ] || exit 0
[ -s vr/glove.hex ] && [ "$(wc -l <angles.csv)" -gt 1000 ] && [ -s report/report.html ] && [ -s paper/report.html ]

[ -x "$(dirname "$1")/flexor-cosim" ] || exit 0  # the package flexor alone

# Both boards simulated, to its ends within 3 degrees.
awk 'BEGIN { print "t_s,thumb_deg,index_deg,middle_deg,ring_deg,pinky_deg"
  for (k = 0; k <= 600; k++) { c = (k - 300) / 50; c = c < 0 ? 0 : c > 1 ? 1 : c; f = 28 + 85 * c
    printf "%.2f,%.2f,%.2f,%.2f,%.2f,%.2f\n", k / 100, 90 + 80 * c, f, f, f, f } }' >hold.csv
flexor experiment --trials 1 --compensators hand.json --gestures hold.csv --engine avr --out boards/ >/dev/null
awk -F, 'function far(got, want) { return got - want > 3 || want - got > 3 }
  NR > 1 && ($1 > 2 && $1 < 3 || $1 > 5) { rows++; fist = $1 > 5
    for (i = 3; i <= 11; i += 2) if (far($i, i == 3 ? (fist ? 170 : 90) : (fist ? 113 : 28))) { print "off: " $0; exit 1 } }
  END { if (rows < 30) exit 1 }' boards/traces/*.csv
