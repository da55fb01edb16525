#!/usr/bin/env bash
# Completion in a real bash, and in fish and zsh where they are: commands, options, choices. Argument: the program.
set -euo pipefail
PATH=$(dirname "$(realpath "$1")"):$PATH
eval "$(flexor completion bash)"
complete -p flexor >/dev/null
due() {  # what is due, then the words up to the cursor
  COMP_WORDS=("${@:2}") COMP_CWORD=$(($# - 2)) COMPREPLY=()
  _flexor flexor
  [ "${COMPREPLY[*]}" = "$1" ] || { echo "${*:2}: ${COMPREPLY[*]}"; exit 1; }
}
due identify flexor id
due "record wear" flexor twin ""
due "--structure" flexor identify --pair a.csv b.csv --str
due "opengloves" flexor deploy m.json --output o
due "opengloves" flexor deploy m.json --output = o
due "--output=opengloves" flexor deploy m.json --output=o
due "" flexor identify --structure ""  # any text
due "" flexor apply ""  # a file
due "" flexor nothing --a
same() { [ "$1" = "identify" ] || { echo "$2: $1"; exit 1; }; }
! command -v fish >/dev/null || same "$(fish -c 'flexor completion fish | source; complete -C "flexor id"')" fish
! command -v zsh >/dev/null || same "$(zsh -c 'autoload -Uz compinit; compinit -D; source <(flexor completion zsh)
  compadd() { print -- ${(P)2} }; words=(flexor id); CURRENT=2; _flexor')" zsh
echo "completed"
