#!/usr/bin/env bash
# An installed tree works from another folder while source and build trees are out of sight.
# Usage: install_test.sh CMAKE BUILD SOURCE INPUTS   (build and source folders, program that makes inputs)
set -euo pipefail
cmake=$1 build=$2 source=$3 inputs=$4

if [ -z "${FLEXOR_OWN_MOUNTS:-}" ]; then
  unshare -rm true 2>/dev/null || { echo "skipped: this user may not hide a folder"; exit 77; }
  FLEXOR_OWN_MOUNTS=1 exec unshare -rm "$0" "$@"
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$cmake" --install "$build" --prefix "$work/prefix" >"$work/log"
"$inputs" "$work"
cd "$work"
mount -t tmpfs none "$build"
mount -t tmpfs none "$source"

expect() {
  local file=$1
  [ -s "$file" ] || { echo "FAILED: no $file"; exit 1; }
}

flexor=prefix/bin/flexor share=prefix/share
"$flexor" --version
"$flexor" show "$share/flexor/models/published_hw.json" >/dev/null
"$flexor" experiment --gestures 1 --trials 1 --out run >/dev/null
expect run/report.html
"$flexor" track video.mp4 --joints "$share/flexor/models/joints/paper_hand.json" --out angles.csv >/dev/null
expect angles.csv
"$flexor" deploy "$share/flexor/models/published_hw.json" --out firmware >/dev/null
expect firmware/glove.hex
for document in flexor/README.md flexor/docs/json.md flexor/copyright flexor-boards/copyright; do expect "$share/doc/$document"; done
# Found through PATH and through a link, as users have it.
mkdir links
ln -s ../prefix/bin/flexor links/flexor
PATH=$work/links:$PATH flexor latency --edges 2 >/dev/null
echo "the installed tree works alone"
