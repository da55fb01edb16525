#!/usr/bin/env bash
# The page of flexor live in a real browser. Usage: browser_test.sh BUILD REPOSITORY PART, where PART is
#   short       units, then one screen of the next
#   page        the page against the program, on phone and desktop
#   markerless  the markerless reference on a film of a real hand
#   journey     the whole way against the program, with the twin
# KEEP names a folder that keeps the pictures.
set -euo pipefail
build=$1
root=$2
part=$3
flexor=$build/flexor
command -v node >/dev/null || { echo "skipped: node is missing"; exit 77; }
[ -d "$root/web/node_modules/playwright-core" ] || { echo "skipped: web/node_modules is missing: script/bootstrap --dev"; exit 77; }
CHROMIUM=${CHROMIUM:-$(command -v chromium || true)}
[ -n "$CHROMIUM" ] || { echo "skipped: chromium is missing: script/bootstrap --dev"; exit 77; }
export CHROMIUM
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
pictures=${KEEP:-$work/pictures}/$part
cd "$root/web"

case $part in
  short)
    npm test --silent
    node live/page_test.mjs "$flexor" "$build/apps/live/page" --short --pictures "$pictures"
    ;;
  page)
    node live/page_test.mjs "$flexor" "$build/apps/live/page" --pictures "$pictures"
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
    node live/journey_test.mjs "$flexor" --pictures "$pictures"
    ;;
esac
