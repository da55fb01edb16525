#!/usr/bin/env bash
# Runs every `flexor` command of docs/opengloves.md, in its order and in one folder; the user's own logs are the twin's.
#   walkthrough_test.sh BUILD SOURCE
set -euo pipefail
build=$(realpath "$1")
page=$(realpath "$2")/docs/opengloves.md
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
flexor() { "$build/flexor" "$@"; }
flexor twin record --out own/ >/dev/null
cp own/glove-1.csv glove.csv
cp own/camera-1.csv camera.csv
count=0
while read -r line; do
  echo "$line"
  eval "$line" >stdout || { echo "failed: $line"; exit 1; }
  count=$((count + 1))
done < <(awk '/^```/ { fenced = !fenced; next }
  fenced { while (sub(/\\$/, "") && (getline more) > 0) $0 = $0 more; if ($0 ~ /^flexor /) print }' "$page")
[ $count -ge 5 ] || { echo "only $count commands in $page"; exit 1; }
[ -s vr/glove.hex ] && [ -s wiring/wiring_glove.svg ] && [ -s logger/glove.hex ]
