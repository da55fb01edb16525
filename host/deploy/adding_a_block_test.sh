#!/usr/bin/env bash
# docs/adding-a-block.md as it stands: its kind of block, added to a copy of the sources, gives the same angles in a document, on the
# host and in the interpreter, and compiles for the board. Usage: adding_a_block_test.sh ROOT LIBRARY_OF_IO
set -euo pipefail
root=$(cd "$1" && pwd)
io=$(realpath "$2")
page=$root/docs/adding-a-block.md
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
piece() { awk -v fence="\`\`\`cpp $1" '$0 == fence { found = 1; next } /^```/ { found = 0 } found' "$page"; }

mkdir -p "$folder/runtime/compensator" "$folder/host/model"
piece runtime/compensator/slew.hpp >"$folder/runtime/compensator/slew.hpp"
piece host/model/kinds.hpp >"$folder/struct.inc"
piece test >"$folder/page_test.inc"
awk -v line="$(piece runtime/compensator/blocks.hpp)" '
  /include .*sum.hpp/ { print "#include \"runtime/compensator/slew.hpp\"" }
  /BLOCK\(sum,/ { print $0 " \\"; print line; next } { print }' "$root/runtime/compensator/blocks.hpp" >"$folder/runtime/compensator/blocks.hpp"
awk -v struct="$(cat "$folder/struct.inc")" '/^}  \/\/ namespace/ { print struct } { print }' "$root/host/model/kinds.hpp" >"$folder/host/model/kinds.hpp"
for file in runtime/compensator/slew.hpp runtime/compensator/blocks.hpp struct.inc; do [ -s "$folder/$file" ]; done

cd "$folder"
flags=(-std=c++20 -O0 -ffunction-sections -DFMT_SHARED -DFLEXOR_VERSION='"page"' -I. -I"$root" -isystem /usr/include/eigen3)
for file in "$root"/host/model/*.cpp; do
  case $file in *_test.cpp | *_fuzz.cpp) ;; *) echo "#include \"$file\"" ;; esac
done >model.cpp
printf '#include "host/deploy/%s"\n' config.cpp model_block.cpp adding_a_block_test.cpp >deploy.cpp
c++ "${flags[@]}" -c model.cpp
c++ "${flags[@]}" -c deploy.cpp
c++ -Wl,--gc-sections deploy.o model.o "$io" -o page_test -lfmt -lgtest -lgtest_main -pthread  # of config.cpp what is asked for
./page_test
if command -v avr-g++ >/dev/null; then
  printf '#include "runtime/compensator/graph.hpp"\nflexor::compensator::Graph<flexor::core::Flash, 600> graph;\nint main() { return graph.step(); }\n' >board.cpp
  avr-g++ -mmcu=atmega328p -std=c++14 -Os -fshort-enums -Wall -Wextra -Werror -I. -I"$root" -c board.cpp -o board.o
fi
