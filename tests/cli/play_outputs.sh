#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Where organplay writes to: said before the work, and nothing of the user's is lost.
source "$(dirname "$0")/assert.sh"
[ -x "$BIN/organplay" ] || { echo "SKIPPED: organplay was not built"; exit 0; }
quick_recipe >r.yaml
expect 0 organbake bake r.yaml -o b --quiet
checksums b >before
cat >s.json <<'END'
{"schema": "organbake/interaction/1", "name": "s", "time_step_s": 0.02, "frames": 2,
 "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0}]}, "instruments": []}
END

refused() {  # CODE TEXT ARGUMENTS…
  local code=$1 text=$2
  shift 2
  case " $* " in *" --size "*) ;; *) set -- "$@" --size 64x48 ;; esac
  expect "$code" "$BIN/organplay" "$@" --quiet
  expect_err "$text"
  expect_sentence
}
refused 2 "give it that ending" b -o x.jpg
refused 2 "give it that ending" b --sheet x
refused 2 "is written as .mp4, .mkv, .mov, .webm or .avi" b --script s.json --video x.gif
refused 2 "is the script itself" b --script s.json --report s.json
refused 2 "name the same file" b -o x.png --sheet ./x.png
refused 2 "--bench goes alone" b -o x.png --bench 2
refused 73 "there is no such folder" b -o none/x.png
refused 73 "there is no such folder" b --script s.json --report none/x.json
refused 73 "there is no such folder" b --script s.json --video none/x.mp4
for file in b/picture.png b/cam_000/new.png ./b/../b/x.png; do
  refused 73 "lies in the bundle" b -o $file
done
refused 73 "lies in the bundle" b --script s.json --out b/frames
# Beside the frames, not among them: the next run would not know it from what it may replace.
refused 2 "--report rc/r.json: lies in --out rc," b --script s.json --out rc --report rc/r.json
refused 2 "--video ./rc/v.mp4: lies in --out rc/," b --script s.json --out rc/ --video ./rc/v.mp4
expect_gone rc
mkdir mine && touch mine/notes.txt
refused 73 "holds 'notes.txt', which is no frame of mine" b --script s.json --out mine
refused 73 "s.json: is a file" b --script s.json --out s.json
refused 73 "s.json: is a file" b --script s.json --out s.json/frames
refused 66 "there is no such folder" nowhere -o x.png
refused 66 "is a file; a bundle is the folder" s.json -o x.png
mkfifo pipe.png && mkdir folder.png
refused 73 "is a device or a pipe" b -o pipe.png
refused 73 "is a folder" b -o folder.png
[ -p pipe.png ] || fail "the pipe was replaced"
for file in x.png x.jpg x frames; do expect_gone $file; done
checksums b | diff - before >/dev/null || fail "the bundle was changed"

# A link's file is written, the link stays.
ln -s real.png link.png
expect 0 "$BIN/organplay" b -o link.png --size 64x48 --quiet
[ -L link.png ] && [ -s real.png ] || fail "the link was replaced"
sed 's/azimuth_rad/azimut_rad/' s.json >typo.json
refused 65 "has the key 'azimut_rad'" b --script typo.json --out frames
sed 's/"frames": 2,/"frames": 2, "frames": 3,/' s.json >twice.json
refused 65 "has the key 'frames' twice" b --script twice.json --out frames
refused 2 "azimuths are at most 360 degrees" b --view-deg 400,10 -o x.png
refused 2 "azimuths are at most 360 degrees" b --view-deg 1,-181 -o x.png
refused 2 "--view-deg nan,0 is no view" b --view-deg nan,0 -o x.png
refused 2 "--view-deg 0,0,-1: the distance" b --view-deg 0,0,-1 -o x.png
refused 2 "--angles-deg 0,,1 are no angles" b --compare --angles-deg 0,,1
refused 2 "--angles-deg nan are no angles" b --compare --angles-deg nan
refused 2 "--angles-deg 1e9: azimuths are at most 360 degrees" b --compare --angles-deg 1e9
refused 2 "unknown flag --view; did you mean '--view-deg'?" b --view 0.5,0.2 -o x.png

# A size is read whole and within bounds, wherever it is for.
for size in 4294967297x5 5x4294967297 0x0 -1x5 20000x20000 5x5x5 " 5x5" 5x 1e2x5; do
  for shown in "-o x.png" "--sheet x.png" "--bench 2" ""; do
    expect 2 "$BIN/organplay" b $shown --size "$size"
    expect_err "--size $size: each side needs a whole number of pixels in 1…16384"
    expect_sentence
  done
done
refused 2 "--size 8x8: --compare needs a height of 16…4096" b --compare --size 8x8
# That of the command line goes before the script's, as its solver does.
sed 's/"frames": 2,/"frames": 1, "size": [40, 30],/' s.json >sized.json
size_of() { od -An -tu1 -j16 -N8 "$1" | awk '{print 256 * $3 + $4 "x" 256 * $7 + $8}'; }
expect 0 "$BIN/organplay" b --script sized.json --out own --quiet
expect_equal "$(size_of own/frame_0000.png)" 40x30
expect 0 "$BIN/organplay" b --script sized.json --out told --size 64x48 --quiet
expect_equal "$(size_of told/frame_0000.png)" 64x48

if [ "$(id -u)" -eq 0 ] && command -v setpriv >/dev/null; then
  as_nobody() { setpriv --reuid 65534 --regid 65534 --clear-groups "$BIN/organplay" "$@"; }
  chmod 755 "$WORK" && cp -r b shut && chmod 700 shut
  # Where nothing can be written is said before the work, whatever was asked for.
  before_the_work() {  # FOLDER ARGUMENTS…
    local folder=$1
    shift
    expect 73 as_nobody broken "$@"
    expect_err "/$folder: cannot be written to: Permission denied"
    expect_sentence
  }
  cp -r b broken && rm broken/proxy.ply  # which would be said next
  mkdir theirs kept && cp own/frame_0000.png theirs && mkdir open && chmod 777 open
  before_the_work kept -o kept/x.png
  before_the_work kept --sheet kept/x.png
  before_the_work shut/deeper -o shut/deeper/x.png
  for asked in "--report kept/x.json" "--video kept/x.mp4" "--out kept/x" "--out kept/a/b"; do
    before_the_work kept --script s.json $asked
  done
  before_the_work shut/deeper --script s.json --out shut/deeper/x
  cp -r theirs open && chmod 755 open/theirs
  before_the_work open/theirs --script s.json --out open/theirs
  expect 0 as_nobody b --script s.json --out open/a/b/ --report open/x.json --size 64x48 --quiet

  expect 66 as_nobody shut -o open/y.png
  expect_err "shut/manifest.json: cannot be looked at"
  expect_sentence
fi
