#!/usr/bin/env bash
# Builds the page of web/live into FOLDER. Where Node or what it needs is missing, puts there one page that states it, and how to mend
# it: everything else is built all the same. Without the markerless model the page lacks that reference alone. Arguments: ROOT FOLDER.
set -euo pipefail
root=$1
out=$2
rm -rf "$out"
mkdir -p "$out"
if [ -d "$root/web/live" ] && [ -e "$root/web/node_modules/.package-lock.json" ] && command -v node >/dev/null && command -v npm >/dev/null; then
  log=$out.log
  FLEXOR_PAGE_OUT=$out npm --prefix "$root/web" run --silent build >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
  [ "${FLEXOR_MARKERLESS:-}" = OFF ] || [ -e "$out/markerless/hand_landmarker.task" ] || echo "page.sh: the page has no markerless reference: script/bootstrap prints why" >&2
  [ -s "$out/index.html" ] || { cat "$log" >&2; echo "page.sh: the build of web/ wrote no index.html" >&2; exit 1; }
else
  cp "$root/apps/live/missing/index.html" "$out/"
fi
