#!/usr/bin/env bash
# Every kind of report as the commands leave it: `flexor report` draws the same bytes again, and in a real browser, as phone and
# desktop, light and dark, nothing is serious for a screen reader, no page wider than its screen, no letters too small; and a page
# that is all of this is noticed.
# Arguments: the build's folder, the repository, simulated_recording, test_inputs.
set -euo pipefail
build=$1 root=$2 simulate=$3 inputs=$4
[ -d "$root/web/node_modules" ] || { echo "skipped: script/bootstrap --dev installs the browser's part"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
flexor=$build/flexor
"$simulate" "$work/logs" >/dev/null
mkdir "$work/inputs"
"$inputs" "$work/inputs" >/dev/null
"$flexor" identify --pair "$work/logs/simulated_glove.csv" "$work/logs/simulated_camera.csv" --structure curve \
  --map "index=simulated_index_adc:∠simulated_index_deg,thumb=simulated_index_adc:∠simulated_index_deg" --report "$work/hand" \
  >/dev/null 2>&1
"$flexor" experiment --trials 2 --gestures 2,4 --scenarios --out "$work/experiment" >/dev/null 2>&1
"$flexor" latency --edges 3 --out "$work/latency" >/dev/null 2>&1
"$flexor" deploy "$root/models/published_hw.json" --rate 10 --out "$work/deployment" >/dev/null 2>&1
"$flexor" track "$work/inputs/video.mp4" --joints "$work/inputs/joints.json" --out "$work/angles.csv" \
  --report "$work/tracking" >/dev/null 2>&1

pages=()
for kind in $(sed -n 's/^#define FLEXOR_REPORTS(X)//p' "$root/host/report/kinds.hpp" | tr -d 'X()'); do
  pages+=("$work/$kind"/*.html)
  cp -r "$work/$kind" "$work/drawn"
  find "$work/$kind" -name '*.html' -delete
  "$flexor" report "$work/$kind" >/dev/null 2>&1
  diff -r "$work/drawn" "$work/$kind" || { echo "$kind: flexor report does not draw what the command drew"; exit 1; }
  rm -r "$work/drawn"
done
[ ${#pages[@]} -ge 7 ] || { echo "kinds found: ${pages[*]}"; exit 1; }
cd "$root/web"
node check_reports.mjs "${pages[@]}"

mkdir "$work/bad"
cat >"$work/bad/report.html" <<'PAGE'
<!doctype html><html><head><title>bad</title></head><body><p style="color: #ccc; background: #ddd">grey on grey</p>
<img src="x.png"><pre>a line that is much too long for any phone, and does not break, since it stands in a block that keeps lines as
they are, whatever the width of the screen may be, and it goes on and on and on and on and on and on and on and on and on</pre>
<svg width="200" height="20"><text x="0" y="10" font-size="3">tiny</text></svg></body></html>
PAGE
if node check_reports.mjs "$work/bad/report.html" >"$work/found"; then
  echo "a bad page passed"
  exit 1
fi
for what in color-contrast image-alt html-has-lang "px wide on" "letters of"; do
  grep -q "$what" "$work/found" || { cat "$work/found"; echo "not noticed: $what"; exit 1; }
done
