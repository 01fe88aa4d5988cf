#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# organbake batch: good and broken cases, a rerun, shards, odd names, a batch that is killed.
source "$(dirname "$0")/assert.sh"
small_recipe >r.yaml
sed 's/^phantom:.*//' r.yaml >scan.yaml
small_phantom p
head -c 2000 p/ct.nii.gz >cut.nii.gz 2>/dev/null || head -c 2000 "$(ls p/ct.* | head -n 1)" >cut.nii.gz
cat >cases.csv <<'END'
case,phantom.seed,ct,decimate.faces,isosurface.iso
one,1,,,
"two, with ""quotes"" & spaces",2,,,
drei-für-alle,3,,40,
missing,,nowhere.nii.gz,,
damaged,,cut.nii.gz,,
typo,4,,minus three,
outside,5,,,30000
END

expect 4 organbake batch cases.csv --recipe r.yaml -o baked --jobs 2
expect 0 organbake verify baked/batch.json
for name in one 'two, with "quotes" & spaces' drei-für-alle; do
  expect 0 organbake verify "baked/$name"
  [ -s "baked/pictures/$name.png" ] || fail "no picture of $name"
done
for name in missing damaged typo outside; do expect_gone "baked/$name"; done
row() { grep "^$1," baked/batch.csv; }
[[ $(row missing) == missing,failed,66,*nowhere.nii.gz* ]] || fail "missing: $(row missing)"
[[ $(row damaged) == damaged,failed,6[56],*cut.nii.gz* ]] || fail "damaged: $(row damaged)"
[[ $(row typo) == typo,failed,78,*decimate.faces* ]] || fail "typo: $(row typo)"
[[ $(row outside) == outside,failed,65,*HU* ]] || fail "outside: $(row outside)"
[ "$(grep -n 'failed' baked/batch.html | tail -n 1 | cut -d: -f1)" -lt \
  "$(grep -n 'written' baked/batch.html | head -n 1 | cut -d: -f1)" ] || fail "the worst is not first"

# A rerun does nothing for what is there; what is mended is baked.
before=$(checksums baked/one)
sed -i 's/minus three/30/' cases.csv
expect 4 organbake batch cases.csv --recipe r.yaml -o baked --progress json --quiet
expect_equal "$(checksums baked/one)" "$before"
[[ $(row one) == one,unchanged,0,* ]] || fail "one: $(row one)"
[[ $(row typo) == typo,written,0,* ]] || fail "typo: $(row typo)"
grep -q '"done":7' err || fail "no progress: $(cat err)"

# A case of a batch is the same as the bake alone; shards share a cache and don't meet.
expect 0 organbake bake r.yaml --set phantom.seed=1 -o alone
expect_same alone baked/one
head -n 4 cases.csv >good.csv
for i in 1 2; do expect 0 organbake batch good.csv --recipe r.yaml -o shards --shard $i/2 --no-pictures; done
expect_same shards/one baked/one
expect_equal "$(ls shards/*.json | xargs -n 1 basename | tr '\n' ' ')" "batch-1-of-2.json batch-2-of-2.json "

# Files by name.
mkdir scans && cp "$(ls p/ct.* | head -n 1)" scans/patient.7"$(ls p/ct.* | head -n 1 | sed 's/.*\/ct//')"
expect 0 organbake batch scans/* --recipe scan.yaml --set photos=p/photos/cameras.json -o byname
expect 0 organbake verify byname/patient.7

# Killed at any time, together with its workers, it leaves nothing half-made.
for i in 1 2 3 4 5; do
  rm -rf killed cache2
  "$BIN/organbake" batch good.csv --recipe r.yaml -o killed --jobs 2 --cache cache2 --no-pictures 2>/dev/null >/dev/null &
  pid=$!
  sleep 0.$((i * 13 % 60 + 10))
  kill -9 $pid 2>/dev/null
  wait $pid 2>/dev/null
  expect 0 organbake batch good.csv --recipe r.yaml -o killed --cache cache2 --no-pictures
  expect_same killed/one baked/one
done
expect_equal "$(pgrep -f "$WORK/killed" | wc -l)" 0

# Wrong calls.
expect 2 organbake batch --recipe r.yaml -o x
expect 2 organbake batch good.csv -o x
expect 2 organbake batch good.csv --recipe r.yaml -o x --shard 3/2
expect 66 organbake batch none.csv --recipe r.yaml -o x
expect 66 organbake batch good.csv --recipe none.yaml -o x
printf 'case\n../up\n' >bad.csv
expect 65 organbake batch bad.csv --recipe r.yaml -o x
expect_err "bad.csv:2"
printf 'name\na\n' >bad.csv
expect 65 organbake batch bad.csv --recipe r.yaml -o x
expect_err "no column 'case'"
printf 'case,ct\na\n' >bad.csv
expect 65 organbake batch bad.csv --recipe r.yaml -o x
printf 'case\na\na\n' >bad.csv
expect 65 organbake batch bad.csv --recipe r.yaml -o x
expect_err "twice"
