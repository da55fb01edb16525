#!/usr/bin/env bash
# No room holds more than a sixth of the sources below the rooms' folders, tests left out; and all lines that git tracks, of
# source and of tests, are no more than the total, which may only fall. Limits that are broken are noticed.
# Argument: the repository.
set -euo pipefail
cd "$1"
readonly kSource=73153 kTests=30928
too_large() {  # PARTS: rooms above one part of so many
  sed -n 's/^flexor_room([a-z]* \([^ )]*\).*/\1/p' cmake/layers.cmake | while read -r room; do
    find "$room" \( -name '*.cpp' -o -name '*.hpp' \) ! -name '*_test.?pp' ! -name '*_fuzz.cpp' -exec cat {} + | wc -l | sed "s|$| $room|"
  done | awk -v parts="$1" '{ size[$2] = $1; all += $1 } END { for (r in size) if (size[r] * parts > all) print r, size[r], "of", all }'
}
found=$(too_large 6)
[ -z "$found" ] || { echo "more than a sixth of the code: $found"; exit 1; }
[ -n "$(too_large 20)" ] || { echo "not noticed: a room above a twentieth"; exit 1; }

tracked() { git ls-files -- apps benchmarks cmake cosim examples firmware host runtime script web python CMakeLists.txt |
  grep -E '\.(hpp|cpp|h|c|ino|ts|mjs|tsx|css|html|py|pyi|cmake|sh|in|mustache)$|(^|/)CMakeLists\.txt$|^script/[a-z_]+$' |
  grep -vE 'package-lock|\.svg$'; }
readonly kIsTest='_test\.|/tests?/|\.test\.ts$|_test$|/fuzz/|_fuzz\.cpp$|/random_[^/]*\.hpp$'
too_many() {  # LIMIT: lines of the files on standard input above it
  tr '\n' '\0' | xargs -0 cat | wc -l | awk -v limit="$1" '$1 > limit { print $1, "lines, at most", limit }'
}
source=$(tracked | grep -vE "$kIsTest" | too_many $kSource)
tests=$(tracked | grep -E "$kIsTest" | too_many $kTests)
[ -z "$source$tests" ] || { echo "the total may only fall; source: ${source:-good}; tests: ${tests:-good}"; exit 1; }
[ -n "$(tracked | too_many 1000)" ] || { echo "not noticed: a total above its limit"; exit 1; }
