#!/usr/bin/env bash
# The check of function lengths passes for the sources and notices a function of 61 lines. Argument: the repository.
set -euo pipefail
"$1/cmake/function_lengths.sh" "$1"
try=$(mktemp --suffix=.cpp)
trap 'rm -f "$try"' EXIT
write() { { echo "int f(int x) {"; for ((i = 0; i < $1 - 3; i++)); do echo "  x += $i;"; done; printf '  return x;\n}\n'; } >"$try"; }
write 60
"$1/cmake/function_lengths.sh" "$1" "$try"
write 61
! "$1/cmake/function_lengths.sh" "$1" "$try"
