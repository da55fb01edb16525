#!/usr/bin/env bash
# docs/adding-a-WHAT.md as it stands, beside a copy of the sources: the kind of block gives the same angles in a document, on the host and in
# the interpreter, and compiles for the board; the board's program writes the angles of flexor apply; the text format is read.
# Usage: adding_test.sh block|board|text-format ROOT PROGRAM LIBRARY_OF_IO
set -euo pipefail
what=$1 root=$(cd "$2" && pwd) io=$(realpath "$4")
PATH=$(dirname "$(realpath "$3")"):$PATH
page=$root/docs/adding-a-$what.md
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
piece() {  # INFO [FILE]: a block of the page, which may not be empty
  mkdir -p "$(dirname "${2:-.}")"
  awk -v fence="\`\`\`$1" '$0 == fence { found = 1; next } /^```/ { found = 0 } found' "$page" >"${2:-part}"
  [ -s "${2:-part}" ]
}
flags=(-std=c++20 -O0 -ffunction-sections -DFMT_SHARED -DFLEXOR_VERSION='"page"' -I. -I"$root" -isystem /usr/include/eigen3)
built() {  # SOURCES...: the page's test with them
  piece "cpp test" page_test.inc
  for source in "$@"; do printf '#include "%s"\n' "$source" >"in_${source//\//_}" && c++ "${flags[@]}" -c "in_${source//\//_}"; done
  c++ -Wl,--gc-sections ./*.o "$io" -o page_test -lfmt -lgtest -lgtest_main -pthread
  ./page_test
}

block() {
  piece "cpp runtime/compensator/slew.hpp" runtime/compensator/slew.hpp
  piece "cpp host/model/kinds.hpp" host/model/struct.inc
  piece "cpp runtime/compensator/blocks.hpp"
  awk -v line="$(cat part)" '
    /include .*sum.hpp/ { print "#include \"runtime/compensator/slew.hpp\"" }
    /BLOCK\(sum,/ { print $0 " \\"; print line; next } { print }' "$root/runtime/compensator/blocks.hpp" >runtime/compensator/blocks.hpp
  awk -v struct="$(cat host/model/struct.inc)" '/^}  \/\/ namespace/ { print struct } { print }' "$root/host/model/kinds.hpp" >host/model/kinds.hpp
  find "$root/host/model" -name '*.cpp' ! -name '*_test.cpp' ! -name '*_fuzz.cpp' -printf '#include "host/model/%f"\n' >model_all.cpp
  built model_all.cpp host/deploy/config.cpp host/deploy/model_block.cpp host/deploy/adding_a_block_test.cpp  # of config.cpp what is asked for
  command -v avr-g++ >/dev/null || return 0
  printf '#include "runtime/compensator/graph.hpp"\nflexor::compensator::Graph<flexor::core::Flash, 600> graph;\nint main() { return graph.step(); }\n' >board.cpp
  avr-g++ -mmcu=atmega328p -std=c++14 -Os -fshort-enums -Wall -Wextra -Werror -I. -I"$root" -c board.cpp -o board.o
}

text-format() {
  piece "cpp format" format.inc
  piece "cpp call" call.inc
  mkdir -p host/recording
  awk -v format="$(cat format.inc)" -v call="$(cat call.inc)" '/^bool read_labelled\(/ { print "namespace {\n" format "\n}  // namespace\n" }
    { print } /if \(read_keyed\(text, cells\)\)/ { print call }' "$root/host/recording/line_format.cpp" >host/recording/line_format.cpp
  printf '#include <gtest/gtest.h>\n#include <sstream>\n#include "host/recording/csv.hpp"\nusing namespace flexor::recording;\n%s\n' \
    'TEST(AddingAFormat, ThePageIsRight) {' '#include "page_test.inc"' '}' >test.cpp
  built test.cpp host/recording/{csv,line_format,lines,recording,stream,table,time,unit}.cpp
}

board() {
  local file counts="520,560,600,640,680"
  for file in Arduino.h converter.cpp main.cpp; do piece "cpp $file" "$file"; done
  piece "sh board" board.sh
  awk 'BEGIN { print "t_s,thumb_count,index_count,middle_count,ring_count,pinky_count"
    for (k = 0; k < 700; k++) { c = (int(k / 175) % 2 ? 700 : 500) + k % 3; printf "%.2f,%d,%d,%d,%d,%d\n", k / 50, c, c, c, c, c } }' >poses.csv
  flexor identify --poses poses.csv --model hand.json >/dev/null
  bash -e board.sh
  printf '#include <cstdint>\nuint16_t converter(uint8_t channel) { return static_cast<uint16_t>(520 + 40 * channel); }\n' >converter.cpp
  bash -e board.sh
  ./glove_pi | head -n 60 >lines || true  # which ends it
  printf 't_s,thumb_count,index_count,middle_count,ring_count,pinky_count\n0,%s\n0.02,%s\n' $counts $counts >counts.csv
  diff <(tail -n 1 lines | awk -F, '{ for (i = 2; i <= 6; i++) print $i }') \
    <(flexor apply hand.json counts.csv --arithmetic fixed | tail -n 1 | awk -F, '{ for (i = 2; i <= 10; i += 2) printf "%.1f\n", $i }')
}

"$what"
