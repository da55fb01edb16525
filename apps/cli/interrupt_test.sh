#!/usr/bin/env bash
# Commands that are interrupted at random instants die of that signal, say so in one line, and leave neither a temporary
# file nor a temporary folder, whatever they were doing: tracking, fitting, drawing, compiling.
# Usage: interrupt_test.sh PROGRAMS SOURCE INPUTS...   (folder with flexor, source tree, programs that make inputs)
set -uo pipefail
programs=$1 source=$2
shift 2
work=$(mktemp -d)
clean='rm -rf "$work"'
trap "$clean" EXIT
in=$work/in
mkdir "$in"
for make in "$@"; do "$make" "$in" || exit 1; done
flexor=$programs/flexor
RANDOM=${FLEXOR_SEED:-2019}
failures=0 interrupted=0 silent=0

fail() {
  echo "FAILED: $1"
  sed 's/^/    /' "$work/err"
  failures=$((failures + 1))
}

# once SIGNAL DELAY_MS COMMAND...: in a folder of its own, with a TMPDIR of its own.
once() {
  local signal=$1 delay_ms=$2 pid status expected
  shift 2
  rm -rf "$work/out" "$work/tmp"
  mkdir "$work/out" "$work/tmp"
  # A shell's background jobs ignore SIGINT; env undoes that. A job that gets its signal before it has become the program
  # runs the trap that it was started with.
  trap - EXIT
  TMPDIR=$work/tmp env --default-signal=INT "$@" >"$work/stdout" 2>"$work/err" </dev/null &
  pid=$!
  sleep "$(printf '%d.%03d' $((delay_ms / 1000)) $((delay_ms % 1000)))"
  kill -s "$signal" "$pid" 2>/dev/null
  wait "$pid" 2>/dev/null
  status=$?
  trap "$clean" EXIT
  expected=$((128 + $(kill -l "$signal")))
  if [ "$status" != "$expected" ]; then
    # Over before the signal: it is quicker than the first time, and the next instants lie before this one.
    [ "$status" = 0 ] || fail "exit $status after $signal at $delay_ms ms: $*"
    whole_ms=$((delay_ms + 1))
  else
    interrupted=$((interrupted + 1))
    if [ -s "$work/err" ]; then
      [ "$(grep -cE '^flexor: (interrupted|stopped: .*)$' "$work/err")" = 1 ] || fail "not one line: $*"
    else
      silent=$((silent + 1)) # before the program had begun to listen
    fi
  fi
  local left
  left=$(find "$work/out" "$work/tmp" -name '*.part-*' -o -name '.deploy-*' -o -path "$work/tmp/*")
  [ -z "$left" ] || fail "left after $signal at $delay_ms ms: $left"
  # A worker's command line names nothing: what it may write to does.
  left=$(grep -lsa "TMPDIR=$work/tmp" /proc/[0-9]*/environ)
  [ -z "$left" ] || fail "still running after $signal at $delay_ms ms: $left"
  pgrep -f "$work" >/dev/null && fail "still running after $signal at $delay_ms ms: $(pgrep -af "$work")"
}

# often TIMES COMMAND...: at instants drawn from the time that the whole command takes here and now.
often() {
  local times=$1 i start whole_ms before=$interrupted
  shift
  rm -rf "$work/out" # the report of a run before that was not interrupted is another job's
  mkdir "$work/out"
  start=$(date +%s%3N)
  TMPDIR=$work "$@" >/dev/null 2>"$work/err" </dev/null || fail "exit $? without a signal: $*"
  whole_ms=$(($(date +%s%3N) - start))
  for ((i = 0; i < times; ++i)); do
    once "$([ $((i % 2)) = 0 ] && echo INT || echo TERM)" $((RANDOM % whole_ms)) "$@"
  done
  [ "$interrupted" -gt "$before" ] || fail "none of $times runs of $whole_ms ms was interrupted: $*"
}

o=$work/out
often 12 "$flexor" track "$in/video.mp4" --joints "$in/joints.json" --out "$o/a.csv" --preview "$o/p.mp4" --report "$o/r"
often 12 "$flexor" identify --sensor "$in/simulated_glove.csv" --reference "$in/simulated_camera.csv" \
  --structure linear --model "$o/m.json" --report "$o/r"
often 12 "$flexor" deploy "$source/models/published_hw.json" --out "$o/d"
often 6 "$flexor" experiment --gestures 1 --trials 2 --out "$o/e"
[ $((2 * silent)) -lt "$interrupted" ] || fail "$silent of $interrupted runs died without a word"
[ "$failures" = 0 ] && echo "$interrupted runs interrupted, nothing left"
exit $((failures > 0))
