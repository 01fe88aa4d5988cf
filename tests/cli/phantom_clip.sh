#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Clips of a scope along a path, with their truth: frames or a video, the same for any number of
# threads; what does not belong together is refused in words.
source "$(dirname "$0")/assert.sh"

small=(--kind laparoscopy --frames 11 --frame-width-px 160 --frame-height-px 90)

expect 0 organbake phantom "${small[@]}" --path tour --breathing-mm 3 --breathing-period-s 1 --blurred 0.2 -o tour
for file in frames/000000.png frames/000010.png truth/000000.exr truth/000010.exr truth/surface.ply; do
  [ -s "tour/$file" ] || fail "tour/$file is missing"
done
expect_equal "$(ls tour/frames | wc -l)" 11
expect_equal "$(ls tour/truth/*.exr | wc -l)" 3
expect_gone tour/clip.mp4
expect 0 organbake inspect tour/truth/surface.ply
python3 - <<'END' || fail "cameras.json and frames.csv do not tell of the clip that was asked for"
import csv, json
cameras = json.load(open("tour/cameras.json"))["cameras"]
assert [c["name"] for c in cameras] == [f"frame_{i:06d}" for i in range(11)], cameras[0]["name"]
rows = list(csv.DictReader(open("tour/truth/frames.csv")))
assert len(rows) == 11
assert sum(float(r["blur_px"]) > 0 for r in rows) == 2
# 25 frames a second: after ten of them 0.4 s of a breath of 1 s have passed, 3 · sin⁴(0.4 π).
assert abs(float(rows[10]["breath_mm"]) - 2.4543) < 1e-3, rows[10]
END

# The same bytes for any number of threads.
expect 0 organbake phantom "${small[@]}" --path tour --breathing-mm 3 --breathing-period-s 1 --blurred 0.2 \
  --threads 1 -o again
expect_same tour again

# The whole frame is larger and longer unless something else is asked for.
expect 0 organbake phantom --kind laparoscopy --path still --frames 1 -o large
expect_equal "$(od -An -tu1 -j16 -N8 large/frames/000000.png | xargs)" "0 0 5 0 0 0 2 208"  # 1280 × 720

if command -v ffmpeg >/dev/null; then
  expect 0 organbake phantom "${small[@]}" --path slide --bit-rate-mbit-per-s 1 -o video
  expect_gone video/frames
  [ "$(head -c 8 video/clip.mp4 | tail -c 4)" = ftyp ] || fail "clip.mp4 is no MP4 file"
  expect 0 organbake phantom "${small[@]}" --path slide --bit-rate-mbit-per-s 1 --threads 1 -o video_again
  expect_same video video_again
  # Untagged, its range would be guessed by whoever reads it.
  expect_equal "$(ffprobe -v error -select_streams v:0 -show_entries stream=color_range -of csv=p=0 video/clip.mp4)" tv
  expect 0 organbake shade video/clip.mp4 -o depth
else
  echo "SKIPPED: no ffmpeg to make videos with"
fi

refused 2 "--path" organbake phantom --kind laparoscopy --breathing-mm 2 -o made
refused 2 "baseline" organbake phantom --kind laparoscopy --path tour --baseline-mm 4 -o made
refused 2 "path" organbake phantom --kind laparoscopy --path upwards -o made
