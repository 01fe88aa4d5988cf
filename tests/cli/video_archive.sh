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
expect_equal "$(grep -o '<tr[^>]*><td>[^<]*' organs/batch.html | sed -n 's/.*<td>//p' | head -n 1)" 2022_cut
grep -q '<img' organs/batch.html || fail "the page has no pictures"
grep -q '<th>shade.frames_shaded' organs/batch.html || fail "the page doesn't tell what was shaded"
grep -q '^2021_clip,.*,2,' organs/batch.csv || fail "of 6 frames not 2 were shaded: $(grep ^2021_clip, organs/batch.csv)"

# A rerun takes what is new.
clip -vf hue=h=7 archive/2022/new.mp4
expect 4 organbake batch 'archive/**/*.mp4' --as frames --recipe "$recipe" -o organs "${small[@]}"
expect_equal "$(grep -c ',unchanged,' organs/batch.csv)" 3
grep -q '^2022_new,written,' organs/batch.csv || fail "the new clip was not baked"
