#!/usr/bin/env bash
# No function of more than 60 lines, outside tables. Arguments: the repository; a file to try instead of its sources.
set -euo pipefail
command -v ctags >/dev/null || { echo "skipped: no ctags (script/bootstrap --dev)"; exit 77; }
cd "$1"
list_sources() { find apps cosim firmware host runtime python/bindings examples benchmarks -name '*.[ch]pp'; }
# Lists of cases and nothing else, by file and name.
tables='^(host/recording/shapes_test.cpp shapes)$'
if [ $# -gt 1 ]; then list_sources() { echo "$2"; }; fi
list_sources "$@" | ctags -L - --fields=+ne --kinds-C++=f -f - 2>/dev/null | awk -F'\t' -v tables="$tables" '
  /^!/ { next }
  {
    from = to = 0
    for (i = 4; i <= NF; i++) {
      if ($i ~ /^line:/) from = substr($i, 6)
      if ($i ~ /^end:/) to = substr($i, 5)
    }
    functions++
    if (to - from + 1 > 60 && ($2 " " $1) !~ tables) { printf "%s:%d: %s has %d lines\n", $2, from, $1, to - from + 1; bad = 1 }
  }
  END {
    if (functions == 0) { print "no functions found"; bad = 1 }
    exit bad
  }'
