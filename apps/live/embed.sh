#!/usr/bin/env bash
# Writes OUT, C++ that carries every file of FOLDER. Arguments: FOLDER OUT.
set -euo pipefail
folder=$1
out=$2

# The bytes of a file between two symbols.
carried() {  # symbol, file
  printf 'asm(".section .rodata\\n.balign 16\\n.global %s\\n%s:\\n.incbin \\"%s\\"\\n.global %s_end\\n%s_end:\\n.byte 0\\n.text");\n' \
    "$1" "$1" "$2" "$1" "$1"
  printf 'extern "C" const char %s[], %s_end[];\n' "$1" "$1"
}
text_of() { printf '{%s, static_cast<std::size_t>(%s_end - %s)}' "$1" "$1" "$1"; }

cd "$folder"
mapfile -t names < <(find . -type f | sed 's,^\./,,' | LC_ALL=C sort)
{
  printf '// Written by apps/live/embed.sh.\n#include "apps/live/assets.hpp"\n\n'
  rows=
  for i in "${!names[@]}"; do
    name=${names[i]}
    [[ $name != *[\"\\]* ]] || { echo "embed.sh: a name that cannot be carried: $name" >&2; exit 1; }
    carried "flexor_asset_$i" "$PWD/$name"
    rows+="    {\"$name\", $(text_of "flexor_asset_$i")},"$'\n'
  done
  printf '\nnamespace flexor::live {\n\nstd::span<const Asset> assets() {\n  static const Asset all[] = {\n%s  };\n  return all;\n}\n\n}  // namespace flexor::live\n' "$rows"
} >"$out.part"
mv "$out.part" "$out"
