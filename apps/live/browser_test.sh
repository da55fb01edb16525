#!/usr/bin/env bash
# The page of flexor live in a real browser. Usage: browser_test.sh BUILD REPOSITORY PART, where PART is
#   short       units, then one screen of the next with a clock that the test steps
#   page        the page against a stand-in for the program, on phone and desktop
#   markerless  the markerless reference on a film of a real hand
#   journey     the whole way against the program with both simulated boards and a film as webcam
# KEEP names a folder that keeps the pictures.
set -euo pipefail
build=$1
root=$2
part=$3
flexor=$build/flexor
command -v node >/dev/null || { echo "skipped: node is missing"; exit 77; }
[ -d "$root/web/node_modules/playwright-core" ] || { echo "skipped: web/node_modules is missing: script/bootstrap tests"; exit 77; }
CHROMIUM=${CHROMIUM:-$(command -v chromium || true)}
[ -n "$CHROMIUM" ] || { echo "skipped: chromium is missing: script/bootstrap tests"; exit 77; }
export CHROMIUM
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
pictures=${KEEP:-$work/pictures}/$part
cd "$root/web"

case $part in
  short)
    npm test --silent
    FLEXOR_PAGE_OUT=$build/apps/live/page node live/page_test.mjs --short --pictures "$pictures"
    ;;
  page)
    FLEXOR_PAGE_OUT=$build/apps/live/page node live/page_test.mjs --pictures "$pictures"
    ;;
  markerless)
    real=$root/../shared/data/video/green_markers.mp4
    [ -e "$real" ] || { echo "skipped: ../shared/data/video/green_markers.mp4 is missing"; exit 77; }
    [ -e "$build/apps/live/page/markerless/hand_landmarker.task" ] || { echo "skipped: the page carries no model"; exit 77; }
    "$build/apps/camera/test_inputs" "$real" "$work/real.mjpeg"
    "$flexor" track "$real" --joints "$root/models/joints/green_markers.json" --out "$work/real.csv" 2>"$work/errors" ||
      { cat "$work/errors"; exit 1; }
    node live/markerless_test.mjs "$flexor" "$work/real.mjpeg" "$work/real.csv" --pictures "$pictures"
    ;;
  journey)
    python3 -c 'import os; os.openpty()' 2>/dev/null || { echo "skipped: no pseudo-terminals"; exit 77; }
    [ -e /usr/share/arduino/hardware/arduino/avr/bootloaders/optiboot ] || { echo "skipped: arduino-core-avr is missing"; exit 77; }
    "$flexor" camera film --motion protocol --mjpeg --out "$work/film" 2>"$work/errors" || { cat "$work/errors"; exit 1; }
    node live/journey_test.mjs "$flexor" "$work/film/video.mjpeg" --pictures "$pictures"
    ;;
esac
