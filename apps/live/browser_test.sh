#!/usr/bin/env bash
# The page of flexor live in a real browser: against a stand-in on phone and desktop, then the whole way against the program with
# both simulated boards and a film as webcam; between them the markerless reference on a film of a real hand. Arguments: build folder, repository. KEEP names a folder that keeps the pictures.
set -euo pipefail
build=$1
root=$2
flexor=$build/flexor
command -v node >/dev/null || { echo "skipped: node is missing"; exit 77; }
[ -d "$root/web/node_modules/playwright-core" ] || { echo "skipped: web/node_modules is missing: script/bootstrap tests"; exit 77; }
CHROMIUM=${CHROMIUM:-$(command -v chromium || true)}
[ -n "$CHROMIUM" ] || { echo "skipped: chromium is missing: script/bootstrap tests"; exit 77; }
export CHROMIUM
python3 -c 'import os; os.openpty()' 2>/dev/null || { echo "skipped: no pseudo-terminals"; exit 77; }
[ -e /usr/share/arduino/hardware/arduino/avr/bootloaders/optiboot ] || { echo "skipped: arduino-core-avr is missing"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
pictures=${KEEP:-$work/pictures}
cd "$root/web"
npm test --silent >"$work/units" 2>&1 || { cat "$work/units"; exit 1; }
FLEXOR_PAGE_OUT=$build/apps/live/page node live/page_test.mjs --pictures "$pictures/page" >"$work/page" 2>&1 || { cat "$work/page"; exit 1; }
"$flexor" camera film --motion protocol --mjpeg --out "$work/film" >/dev/null 2>&1
# The landmarker, on a film of a real hand.
real=$root/../shared/data/video/green_markers.mp4
if [ ! -e "$real" ]; then
  echo "left out, the markerless reference: no ../shared/data/video/green_markers.mp4"
elif [ ! -e "$build/apps/live/page/markerless/hand_landmarker.task" ]; then
  echo "left out, the markerless reference: the page carries no model"
else
  "$build/apps/camera/test_inputs" "$real" "$work/real.mjpeg"
  "$flexor" track "$real" --joints "$root/models/joints/green_markers.json" --out "$work/real.csv" >/dev/null 2>&1
  node live/markerless_test.mjs "$flexor" "$work/real.mjpeg" "$work/real.csv" --pictures "$pictures/markerless"
fi
node live/journey_test.mjs "$flexor" "$work/film/video.mjpeg" --pictures "$pictures/journey"
