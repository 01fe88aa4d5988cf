#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A whole archive of videos: clips are found in its folders, the sharpest frames shaded, the surest
# one bundled; a page shows all.
source "$(dirname "$0")/assert.sh"
recipe=$SOURCE/pipelines/recipes/video_archive.yaml
expect 0 organbake verify "$recipe"
expect 0 organbake phantom --kind laparoscopy --frames 6 --frame-width-px 160 --frame-height-px 120 -o p
mkdir -p "archive/2021/july" archive/2022
clip() { ffmpeg -v error -framerate 25 -i p/frames/%06d.png -c:v mpeg4 -q:v 2 "$@" || fail "ffmpeg"; }
clip "archive/2021/july/clip 1.mp4"
clip -vf hue=h=9 archive/2021/clip.mp4
clip -vf hue=h=5 archive/2022/clip.mp4
head -c 3000 archive/2022/clip.mp4 >archive/2022/cut.mp4
: >archive/2022/._clip.mp4
small=(--set shade.sharpest=3 --set place.size_px=48 --set decimate.faces=60 --set decimate.method=quadric)

expect 4 organbake batch 'archive/**/*.mp4' --as frames --recipe "$recipe" -o organs --jobs 2 "${small[@]}"
expect_equal "$(tail -n +2 organs/batch.csv | cut -d, -f1,2 | tr '\n' ' ')" \
  "2021_clip,written 2021_july_clip 1,written 2022_clip,written 2022_cut,failed "
expect_equal "$(grep -o '<tr[^>]*><td[^>]*>[^<]*' organs/batch.html | sed -n 's/.*>//p' | head -n 1)" 2022_cut
grep -q '<img' organs/batch.html || fail "the page has no pictures"
grep -q '<th>shade.<wbr>frames_shaded' organs/batch.html || fail "the page doesn't tell what was shaded"
grep -q '^2021_clip,.*,2,' organs/batch.csv || fail "of 6 frames not 2 were shaded: $(grep ^2021_clip, organs/batch.csv)"

# A rerun takes what is new.
clip -vf hue=h=7 archive/2022/new.mp4
expect 4 organbake batch 'archive/**/*.mp4' --as frames --recipe "$recipe" -o organs "${small[@]}"
expect_equal "$(grep -c ',unchanged,' organs/batch.csv)" 3
grep -q '^2022_new,written,' organs/batch.csv || fail "the new clip was not baked"

# A long video is cut into its best spans, and the others are listed with the reason: two seconds of
# a scope that slides, then two of one that stands still.
for path in slide still; do
  expect 0 organbake phantom --kind laparoscopy --path $path --frames 50 --frame-width-px 320 \
    --frame-height-px 180 -o $path
done
mkdir both long
cp slide/frames/*.png both
for frame in still/frames/*.png; do
  cp "$frame" "both/$(printf %06d $((10#$(basename "$frame" .png) + 50))).png"
done
ffmpeg -v error -framerate 25 -i both/%06d.png -c:v mpeg4 -q:v 2 -g 10 long/day.mp4 || fail "ffmpeg"
spans=(--set spans.samples_per_s=8 --set spans.longest_s=2 --set spans.shortest_s=1 --set spans.best=1)
expect 0 organbake spans long/day.mp4 --samples-per-s 8 --longest-s 2 --shortest-s 1 --best 1 -o spans.csv
grep -qE '^[0-9]+,([0-9]|[1-4][0-9]),.*,yes,"the scope moves over steady tissue' spans.csv || fail "$(cat spans.csv)"
grep -q ',no,"the scope stands still"' spans.csv || fail "$(cat spans.csv)"
expect 0 organbake batch 'long/*.mp4' --as frames --recipe "$recipe" -o spells "${small[@]}" "${spans[@]}" \
  --set motion.key_frames=3 --set motion.halvings=0
grep -q '^day_000[01]s,written,0' spells/batch.csv || fail "the sliding span was not baked: $(cat spells/batch.csv)"
grep -q 'motion' spells/day_000[01]s/report.json || fail "it was not baked by motion"
grep -q '^day_000[1-3]s,left out,0,.*stands still' spells/batch.csv ||
  fail "what was left out is not told: $(cat spells/batch.csv)"
grep -q 'stands still' spells/batch.html || fail "the page does not tell what was left out"
