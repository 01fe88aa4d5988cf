#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A data set of two organs: the same bytes for any number of threads, and when it was killed.
source "$(dirname "$0")/assert.sh"
[ -x "$BIN/organplay" ] || { echo "SKIPPED: organplay was not built"; exit 0; }
quick_recipe >r.yaml
expect 0 organbake bake r.yaml -o one --quiet
expect 0 organbake bake r.yaml -o two --quiet --set decimate.faces=70
cat >d.yaml <<'END'
schema: organbake/dataset/1
name: pokes & views
seed: 3
frames: 36
clip_frames: 3
shard_frames: 6
size: [96, 64]
layers: [depth, flow, mask]
stereo_mm: 5
test_share: 0.5
pokes: {count: [1, 2], depth_mm: [4, 12]}
gain: [0.7, 1.4]
noise: [0, 3]
END
echo '{"schema": "organbake/dataset/1", "frames": 4, "layers": ["depth"], "gain": [0.5, 2]}' >d.json
expect 0 organbake verify d.json
make() { "$BIN/organplay" one two --dataset d.yaml -o "$@" --quiet; }
expect 0 make all
expect_equal "$(ls -d all/train/*_0000 all/test/*_0000 | wc -l)" 2
expect_equal "$(ls all/train all/test | grep -c _000)" 6
expect_equal "$(find all -name 'frame_*.png' | wc -l)" 72
expect_equal "$(find all -name 'flow_*.exr' | wc -l)" 72
[ "$(ls all/train | cut -d_ -f2 | sort -u)" != "$(ls all/test | cut -d_ -f2 | sort -u)" ] ||
  fail "one organ is on both sides"
grep -q '"frames_with_contact": [1-9]' all/card.json || fail "no poke touched"
grep -q 'pokes &amp; views' all/index.html || fail "the page does not name its data set"

expect 0 make single --threads 1
expect_same all single

# Killed again and again, it gets done, and is the same.
for ((i = 0; i < 60; i++)); do
  (exec "$BIN/organplay" one two --dataset d.yaml -o killed --quiet) >/dev/null 2>&1 &  # exec: or its shell is killed
  pid=$!
  sleep_ms $((60 + 40 * i))
  kill -9 $pid 2>/dev/null || { wait $pid; break; }
  wait $pid 2>/dev/null
  shards=$(ls -d killed/*/*_000? 2>/dev/null | wc -l)
  [ "$shards" -gt 0 ] && [ "$shards" -lt 6 ] && partly=yes
done
expect 0 make killed
expect_same all killed
[ "${partly:-no}" = yes ] || echo "note: no run was ended between two shards"

# Skin held and tissue cut; of one organ there is no split, which is said.
echo '{"schema": "organbake/dataset/1", "frames": 16, "clip_frames": 8, "size": [64, 48],
  "pokes": {"count": 2, "tools": ["grab", "cut"]}}' >tools.json
expect 0 organbake verify tools.json
expect 0 "$BIN/organplay" one --dataset tools.json -o tools
expect_err "test_share is of the organs, and there is one"
grep -q "there is one: all of it is for training" tools/index.html || fail "the page does not say it"
expect_equal "$(ls tools)" "$(printf 'card.json\nindex.html\nspec.json\ntrain')"
grep -q '"frames_with_contact": [1-9]' tools/card.json || fail "no tool touched"
expect 0 organbake bake r.yaml -o shell --quiet --set mechanics.fem=false
refused 2 "was baked without tetrahedra and cannot be cut" "$BIN/organplay" shell --dataset tools.json -o made

# Through a scope's lens, whose size the pictures have.
lens='"width": 80, "height": 60, "fx": 90, "fy": 90, "cx": 40, "cy": 30'
echo '{"schema": "organbake/dataset/1", "frames": 4, "clip_frames": 2, "layers": ["all"], "lens": {'"$lens"',
  "distortion_k1_k2_p1_p2_k3": [-0.3, 0.1, 0.001, 0.002, 0], "vignette_exponent": 2}}' >lens.json
expect 0 organbake verify lens.json
expect 0 "$BIN/organplay" one --dataset lens.json -o seen --quiet
grep -q '"distortion_k1_k2_p1_p2_k3"' seen/train/*/cameras.json || fail "the cameras have no distortion"
expect_equal "$(od -An -j16 -N8 -tu4 --endian=big seen/train/*/frame_0003.png | xargs)" "80 60"
echo '{"schema": "organbake/dataset/1", "frames": 4, "lens": {'"$lens"',
  "distortion_k1_k2_p1_p2_k3": [-9, 0, 0, 0, 0]}}' >folds.json

refuse() {  # CODE TEXT ARGUMENTS…
  local code=$1 text=$2
  shift 2
  expect "$code" "$BIN/organplay" "$@" --quiet
  expect_err "$text"
  expect_sentence
}
refuse 2 "of another spec or of other bundles" two one --dataset d.yaml -o all
mkdir mine && touch mine/notes.txt
refuse 2 "holds something else" one --dataset d.yaml -o mine
refuse 2 "needs -o DIR" one --dataset d.yaml
refuse 2 "goes alone" one --dataset d.yaml -o made --layers depth
refuse 73 "lies in the bundle" one --dataset d.yaml -o one/set
refuse 65 "folds the picture over itself" one --dataset folds.json -o made
refuse 66 "none.yaml" one --dataset none.yaml -o made
# What is wrong with a spec is said with its file, key and value, before anything is made.
expect 0 organbake verify d.yaml
expect_out "ok (dataset)"
expect 0 organbake verify d.json
for wrong in 's/frames: 36/frames: 0/|frames|0' 's/shard_frames: 6/shard_frames: 2/|shard_frames|2' \
             's/gain: .0.7, 1.4./gain: [1.4, 0.7]/|gain|1.4' 's/depth, flow, mask/depth, flou/|layers|flou' \
             's/test_share: 0.5/test_share: 1.5/|test_share|1.5' 's/seed: 3/sead: 3/|sead|sead'; do
  sed "${wrong%%|*}" d.yaml >bad.yaml
  key=${wrong#*|}
  expect 65 organbake verify bad.yaml
  for word in bad.yaml "${key%|*}" "${key#*|}"; do expect_err "$word"; done
  refuse 65 "bad.yaml" one --dataset bad.yaml -o made
  for word in "${key%|*}" "${key#*|}"; do expect_err "$word"; done
done
sed 's/seed: 3/sead: 3/' d.yaml >bad.yaml
refuse 65 "bad.yaml" one --dataset bad.yaml -o made
expect_gone made
