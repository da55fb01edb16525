#!/usr/bin/env bash
# Every output of every command on a disk that is full, from the first byte on and some kilobytes later: exit 1, one line
# that says so, nothing half-written, what was there before as it was.
# Usage: full_disk_test.sh PROGRAMS SOURCE INPUTS...   (folder with flexor, source tree, programs that make inputs)
set -uo pipefail
programs=$1 source=$2
shift 2
readonly kSkipped=77 kPage=4096 kPages=4096

if [ -z "${FLEXOR_OWN_MOUNTS:-}" ]; then
  unshare -rm true 2>/dev/null || { echo "skipped: this user may not mount a tmpfs"; exit "$kSkipped"; }
  FLEXOR_OWN_MOUNTS=1 exec unshare -rm "$0" "$programs" "$source" "$@"
fi

work=$(mktemp -d)
trap 'mountpoint -q "$disk" && umount "$disk"; rm -rf "$work"' EXIT
in=$work/in disk=$work/disk
mkdir "$in" "$disk" "$work/tmp"
mount -t tmpfs -o size=$((kPages * kPage)) flexor "$disk" || { echo "skipped: a tmpfs cannot be mounted"; exit "$kSkipped"; }
for make in "$@"; do "$make" "$in" || exit 1; done
export TMPDIR=$work/tmp
flexor=$programs/flexor
glove=$in/simulated_glove.csv camera=$in/simulated_camera.csv hw=$source/models/published_hw.json
failures=0

fail() {
  echo "FAILED: $1"
  sed 's/^/    /' "$work/err"
  failures=$((failures + 1))
}

listing() { (cd "$disk" && find . ! -name ballast | sort | while read -r f; do [ -f "$f" ] && sha256sum "$f" || echo "$f"; done); }

# Leaves `pages` free pages, with whatever `old` files already there.
fill() {
  rm -f "$disk/ballast"
  dd if=/dev/zero of="$disk/ballast" bs=64K 2>/dev/null
  [ "$1" -eq 0 ] || truncate -s $(($(stat -c %s "$disk/ballast") - $1 * kPage)) "$disk/ballast"
}

# The one line, after progress and warnings.
says_full() {
  [ "$(tail -n 1 "$work/err" | grep -c '^flexor: .*: cannot be written: No space left on device$')" = 1 ] &&
    [ "$(grep -c '^flexor:' "$work/err")" = 1 ]
}

no_temporaries() { [ -z "$(find "$disk" -name '*.part-*')" ] && [ -z "$(ls -A "$work/tmp")" ]; }

# file NAME COMMAND...: NAME on the disk is the output, and exists before. Tried with no page free, with half of what it needs,
# and with one page too few: the last byte counts.
file() {
  local name=$1 whole free status before
  shift
  rm -rf "${disk:?}"/*
  "$@" >"$work/out" 2>"$work/err" </dev/null || fail "exit $? with room: $*"
  whole=$(($(stat -c %b "$disk/$name") / (kPage / 512)))
  for free in $(printf '%s\n' 0 $((whole / 2)) $((whole - 1 - ${SPARSE:-0})) | sort -nu); do
    rm -rf "${disk:?}"/*
    echo old >"$disk/$name"
    fill "$free"
    before=$(listing)
    "$@" >"$work/out" 2>"$work/err" </dev/null
    status=$?
    [ "$status" = 1 ] || fail "exit $status instead of 1, $free of $whole pages free: $*"
    says_full || fail "not one line on the full disk, $free of $whole pages free: $*"
    [ "$(listing)" = "$before" ] || fail "not as before, $free of $whole pages free: $* $(listing)"
    no_temporaries || fail "temporaries left, $free of $whole pages free: $*"
  done
  small_disk "$whole" "$@"
}

# small_disk PAGES COMMAND...: a disk of 64 KB, empty but for the folder's own page. What fits is written; else as above.
small_disk() {
  local whole=$1 status
  shift
  rm -rf "${disk:?}"/*
  mount -o remount,size=64K "$disk"
  "$@" >"$work/out" 2>"$work/err" </dev/null
  status=$?
  if [ $((whole - ${SPARSE:-0})) -le 16 ]; then
    [ "$status" = 0 ] || fail "exit $status on a disk of 64 KB, where $whole pages are needed: $*"
  else
    [ "$status" = 1 ] && says_full || fail "exit $status and not one line on a disk of 64 KB: $*"
    [ -z "$(find "$disk" -type f)" ] || fail "half written on a disk of 64 KB: $(listing) $*"
  fi
  mount -o remount,size=$((kPages * kPage)) "$disk"
}

# folder PAGES COMMAND...: files go into $disk/new; with 0 to PAGES - 1 free pages they do not fit.
folder() {
  local pages=$1 free status
  shift
  for ((free = 0; free < pages; ++free)); do
    rm -rf "${disk:?}"/*
    mkdir "$disk/new"
    fill "$free"
    "$@" >"$work/out" 2>"$work/err" </dev/null
    status=$?
    [ "$status" = 1 ] || fail "exit $status instead of 1, $free pages free: $*"
    says_full || fail "not one line on the full disk, $free pages free: $*"
    no_temporaries || fail "temporaries left, $free pages free: $*"
    [ ! -e "$disk/new/report.html" ] || fail "a report, though it is not whole: $*"
  done
}

# stdout COMMAND...: standard output is a full file, then a full device.
stdout() {
  local target status
  for target in "$disk/out" /dev/full; do
    rm -rf "${disk:?}"/*
    : >"$disk/out"
    fill 0
    "$@" >"$target" 2>"$work/err" </dev/null
    status=$?
    [ "$status" = 1 ] || fail "exit $status instead of 1, standard output is $target: $*"
    says_full || fail "not one line about standard output, $target: $*"
  done
}

align=("$flexor" align --sensor "$glove" --reference "$camera")
file a.csv "${align[@]}" --out "$disk/a.csv"
file a.mat "${align[@]}" --out "$disk/a.mat"
SPARSE=1 file a.mat "${align[@]}" --out "$disk/a.mat" --mat-version 7.3 # HDF5 leaves out a page of zeros when it must

identify=("$flexor" identify --sensor "$glove" --reference "$camera" --structure linear)
file m.json "${identify[@]}" --model "$disk/m.json"
folder 2 "${identify[@]}" --report "$disk/new"

track=("$flexor" track "$in/video.mp4" --joints "$in/joints.json")
file a.csv "${track[@]}" --out "$disk/a.csv"
file p.mp4 "${track[@]}" --out "$work/a.csv" --preview "$disk/p.mp4"
file p.avi "${track[@]}" --out "$work/a.csv" --preview "$disk/p.avi"
file p.mkv "${track[@]}" --out "$work/a.csv" --preview "$disk/p.mkv"
folder 2 "${track[@]}" --out "$work/a.csv" --report "$disk/new"
setup=("$flexor" track --setup "$in/video.mp4" --joints "$in/joints.json")
file s.png "${setup[@]}" --out "$disk/s.png"
file s.json "${setup[@]}" --out "$work/s.png" --save "$disk/s.json"
file lens.json "$flexor" camera calibrate "$in"/board?.png --out "$disk/lens.json"
folder 1 "$flexor" camera film --gestures 1 --set camera.rate_hz=1 --out "$disk/new"

experiment=("$flexor" experiment --gestures 1 --trials 1 --threads 1 --compensators raw)
folder 4 "${experiment[@]}" --out "$disk/new"
file t.vcd "${experiment[@]}" --engine avr --vcd "$disk/t.vcd"
folder 1 "$flexor" calibrate-glove --rounds 2 --out "$disk/new"
file twin.json "$flexor" calibrate-twin --evaluations 1 --trials 1 --out "$disk/twin.json"
folder 3 "$flexor" deploy "$hw" --out "$disk/new"
folder 2 "$flexor" latency --edges 2 --out "$disk/new"

printf 't_s,thumb_alpha,index_alpha,middle_alpha,ring_alpha,pinky_alpha\n' >"$in/log.csv"
for k in 0 1 2 3 4 5 6 7 8 9; do echo "0.$k,$((40 + k)),50,60,70,80" >>"$in/log.csv"; done
printf 't_s,a_deg\n0,1\n1,2\n2,3\n' >"$in/a.csv"
for json in "" --json; do
  stdout "${align[@]}" $json
  stdout "${identify[@]}" $json
  stdout "${track[@]}" --out "$work/a.csv" $json
  stdout "${setup[@]}" --out "$work/s.png" $json
  stdout "$flexor" camera calibrate "$in"/board?.png --out "$work/lens.json" $json
  stdout "${experiment[@]}" $json
  stdout "$flexor" calibrate-twin --evaluations 1 --trials 1 --out "$work/twin.json" $json
  stdout "$flexor" latency --edges 2 $json
  stdout "$flexor" twin $json
  stdout "$flexor" show "$hw" $json
  stdout "$flexor" score "$in/a.csv" "$in/a.csv" $json
  stdout "$flexor" apply "$hw" "$in/log.csv" $json
done
stdout "$flexor" --help
stdout "$flexor" apply --help
stdout "$flexor" --version

[ "$failures" = 0 ] && echo "every output says when the disk is full"
exit $((failures > 0))
