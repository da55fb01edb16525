#!/usr/bin/env bash
# No room holds more than a sixth of the lines of C++ below the rooms' folders, tests left out; and a limit that one room breaks is
# noticed. Argument: the repository.
set -euo pipefail
cd "$1"
too_large() {  # PARTS: rooms above one part of so many
  sed -n 's/^set(FOLDER_[a-z]* \(.*\))$/\1/p' cmake/layers.cmake | while read -r room; do
    find "$room" \( -name '*.cpp' -o -name '*.hpp' \) ! -name '*_test.cpp' ! -name '*_fuzz.cpp' -exec cat {} + | wc -l | sed "s|$| $room|"
  done | awk -v parts="$1" '{ size[$2] = $1; all += $1 } END { for (r in size) if (size[r] * parts > all) print r, size[r], "of", all }'
}
found=$(too_large 6)
[ -z "$found" ] || { echo "more than a sixth of the code: $found"; exit 1; }
[ -n "$(too_large 20)" ] || { echo "not noticed: a room above a twentieth"; exit 1; }
