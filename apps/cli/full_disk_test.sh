#!/usr/bin/env bash
# Every output of every command on a disk that is full, from the first byte on and some kilobytes later: exit 1, one line
# that says so, nothing half-written, what was there before as it was.
# Usage: full_disk_test.sh PROGRAMS SOURCE INPUTS...   (folder with flexor, source tree, programs that make inputs)
set -uo pipefail
programs=$1 source=$2
shift 2
readonly kSkipped=77 kPage=4096 kAll=8M

if [ -z "${FLEXOR_OWN_MOUNTS:-}" ]; then
  unshare -rm true 2>/dev/null || { echo "skipped: this user may not mount a tmpfs"; exit "$kSkipped"; }
  FLEXOR_OWN_MOUNTS=1 exec unshare -rm "$0" "$programs" "$source" "$@"
fi

work=$(mktemp -d)
trap 'mountpoint -q "$disk" && umount "$disk"; rm -rf "$work"' EXIT
in=$work/in disk=$work/disk
mkdir "$in" "$disk" "$work/tmp"
mount -t tmpfs -o size=$kAll flexor "$disk" || { echo "skipped: a tmpfs cannot be mounted"; exit "$kSkipped"; }
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

# Pages of all files on the disk but the ballast.
used() { find "$disk" -type f ! -name ballast -printf '%b\n' | awk '{n += $1} END {print n / (4096 / 512)}'; }

try() { "$@" >"$work/out" 2>"$work/err" </dev/null; }

# refused FREE WHOLE COMMAND...: with FREE of the WHOLE pages that it takes.
refused() {
  local status free="$1 of $2 pages free"
  shift 2
  try "$@"
  status=$?
  [ "$status" = 1 ] || fail "exit $status instead of 1, $free: $*"
  says_full || fail "not one line on the full disk, $free: $*"
  no_temporaries || fail "temporaries left, $free: $*"
}

# file NAME COMMAND...: NAME on the disk is the output, beside an older NAME: with no page free, and with one page too few: the
# last byte counts. FREE, in pages, is instead of this, where a run is dear.
file() {
  local name=$1 whole=0 free before
  shift
  if [ -z "${FREE:-}" ]; then
    rm -rf "${disk:?}"/*
    try "$@" || fail "exit $? with room: $*"
    whole=$(used)
  fi
  for free in ${FREE:-$(printf '%s\n' 0 $((whole - 1)) | sort -nu)}; do
    rm -rf "${disk:?}"/*
    echo old >"$disk/$name"
    fill "$free"
    before=$(listing)
    refused "$free" "$whole" "$@"
    [ "$(listing)" = "$before" ] || fail "not as before, $free of $whole pages free: $* $(listing)"
  done
}

# folder COMMAND...: files go into $disk/new. With no page free, and with one too few for the last of them; or with FREE pages.
# With START, a folder, new is a copy of it. What was written with room is in $work/whole afterwards.
folder() {
  local whole=0 free
  begin() {
    rm -rf "${disk:?}"/*
    mkdir "$disk/new"
    [ -z "${START:-}" ] || cp -r "$START/." "$disk/new"
  }
  if [ -z "${FREE:-}" ]; then
    begin
    whole=$(used)
    try "$@" || fail "exit $? with room: $*"
    whole=$(($(used) - whole))
    rm -rf "$work/whole"
    cp -r "$disk/new" "$work/whole"
  fi
  for free in ${FREE:-0 $((whole - 1))}; do
    begin
    fill "$free"
    refused "$free" "$whole" "$@"
    [ ! -e "$disk/new/report.html" ] || fail "a report, though it is not whole, $free of $whole pages free: $*"
  done
}

# stdout TARGET COMMAND...: standard output is TARGET, a file on the full disk or a full device.
stdout() {
  local target=$1 status
  shift
  rm -rf "${disk:?}"/*
  : >"$disk/out"
  fill 0
  "$@" >"$target" 2>"$work/err" </dev/null
  status=$?
  [ "$status" = 1 ] || fail "exit $status instead of 1, standard output is $target: $*"
  says_full || fail "not one line about standard output, $target: $*"
}

printf 't_s,thumb_alpha,index_alpha,middle_alpha,ring_alpha,pinky_alpha\n' >"$in/log.csv"
printf 't_s,thumb_deg,index_deg,middle_deg,ring_deg,pinky_deg\n' >"$in/motion.csv"
for k in 0 1 2 3 4 5 6 7 8 9; do
  echo "0.$k,$((40 + k)),50,60,70,80" >>"$in/log.csv"
  echo "0.$k,100,50,50,50,$((30 + k))" >>"$in/motion.csv"
done

align=("$flexor" align --sensor "$glove" --reference "$camera")
file a.csv "${align[@]}" --out "$disk/a.csv"

identify=("$flexor" identify --sensor "$glove" --reference "$camera" --structure linear)
file m.json "${identify[@]}" --model "$disk/m.json"
printf 't_s,index_deg\n0,-20\n' >"$in/angles_in.csv"
file f.csv "$flexor" posture complete "$source/models/posture.json" "$in/angles_in.csv" --from index_deg --bends index=index_mcp+index_pip --out "$disk/f.csv"
folder "${identify[@]}" --report "$disk/new"
# With room for the angles it would go on to fit what it cannot: the video is short.
FREE="0 1" folder "$flexor" identify --sensor "$glove" --reference "$in/video.mp4" --joints "$in/joints.json" \
  --output index_mcp_deg --structure linear --report "$disk/new"

printf 't_s,a_deg,b_deg\n' >"$in/angles.csv"
for k in {100..999}; do echo "$k.5,1.25,$k.125" >>"$in/angles.csv"; done
file a.mcap "$flexor" export "$in/angles.csv" --to mcap --start 2026-05-01T12:00:00Z --out "$disk/a.mcap"

track=("$flexor" track "$in/video.mp4" --joints "$in/joints.json")
file a.csv "${track[@]}" --out "$disk/a.csv"
file p.mp4 "${track[@]}" --out "$work/a.csv" --preview "$disk/p.mp4"
folder "${track[@]}" --out "$work/a.csv" --report "$disk/new"
setup=("$flexor" track --setup "$in/video.mp4" --joints "$in/joints.json")
file s.png "${setup[@]}" --out "$disk/s.png"
file s.json "${setup[@]}" --out "$work/s.png" --save "$disk/s.json"
file lens.json "$flexor" camera calibrate "$in"/board?.png --out "$disk/lens.json"
film=("$flexor" camera film --gestures "$in/motion.csv" --set camera.rate_hz=1)
FREE=0 folder "${film[@]}" --out "$disk/new"

raw=(--trials 1 --threads 1 --compensators raw)
folder "$flexor" experiment --gestures 1 "${raw[@]}" --out "$disk/new"
folder "$flexor" twin record --out "$disk/new"
folder "$flexor" deploy "$hw" --out "$disk/new"
FREE=4 folder "$flexor" deploy "$hw" --output opengloves --out "$disk/new"
folder "$flexor" latency --edges 2 --out "$disk/new"
rm "$work/whole/report.html"
mv "$work/whole" "$work/job"
START=$work/job folder "$flexor" report "$disk/new"

for json in "" --json; do
  target=$([ -z "$json" ] && echo "$disk/out" || echo /dev/full)
  stdout "$target" "${align[@]}" $json
  stdout "$target" "${identify[@]}" $json
  stdout "$target" "$flexor" experiment --gestures 1 "${raw[@]}" $json
  stdout "$target" "$flexor" twin $json
  stdout "$target" "$flexor" apply "$hw" "$in/log.csv" $json
done
stdout /dev/full "$flexor" --help
stdout "$disk/out" "$flexor" apply --help
stdout /dev/full "$flexor" --version

[ "$failures" = 0 ] && echo "every output says when the disk is full"
exit $((failures > 0))
