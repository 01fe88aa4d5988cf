#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# organbake batch: good and broken cases, a rerun, shards, odd names, memory.
source "$(dirname "$0")/assert.sh"
quick_recipe >r.yaml
sed 's/^phantom:.*//' r.yaml >scan.yaml
small_phantom p

# 20 cases, 5 of them broken in ways of their own; odd names among the good.
mkdir dicom && { head -c 128 /dev/zero; printf 'DICMjunk'; } >dicom/1.dcm
: >empty.mp4
cat >cases.csv <<'END'
case,phantom.seed,ct,frames,decimate.facez,isosurface.iso
one,1,,,,
"two, with ""quotes"" & spaces",2,,,,
drei-für-alle,3,,,,
missing,,nowhere.nii.gz,,,
damaged,,dicom,,,
empty,,,empty.mp4,,
typo,4,,,30,
outside,5,,,,30000
END
for i in $(seq 12); do echo "more $i,$((5 + i)),,,," >>cases.csv; done

expect 4 organbake batch cases.csv --recipe r.yaml -o baked --jobs 2
expect_err "20 of 20"
expect 0 organbake verify baked/batch.json
for name in one 'two, with "quotes" & spaces' drei-für-alle "more "{1..12}; do
  expect 0 organbake verify "baked/$name"
  [ -s "baked/pictures/$name.png" ] || fail "no picture of $name"
done
for name in missing damaged empty typo outside; do expect_gone "baked/$name"; done
row() { grep "^$1," baked/batch.csv; }
# Each says what is wrong, and what to do or what would be right.
[[ $(row missing) == missing,failed,66,*nowhere.nii.gz*"correct the path"* ]] || fail "missing: $(row missing)"
[[ $(row damaged) == damaged,failed,65,*dicom*"copy the series again"* ]] || fail "damaged: $(row damaged)"
[[ $(row empty) == empty,failed,65,*empty.mp4*"copy the video again"* ]] || fail "empty: $(row empty)"
[[ $(row typo) == typo,failed,78,*"did you mean 'faces'"* ]] || fail "typo: $(row typo)"
[[ $(row outside) == outside,failed,65,*"choose --set isosurface.iso=… inside"* ]] || fail "outside: $(row outside)"
expect_equal "$(grep -c ',failed,' baked/batch.csv)" 5
[ "$(grep -n 'failed (' baked/batch.html | tail -n 1 | cut -d: -f1)" -lt \
  "$(grep -n 'written' baked/batch.html | head -n 1 | cut -d: -f1)" ] || fail "the worst is not first"

# A rerun does nothing for what is there; what is mended is baked.
before=$(checksums baked/one)
sed -i 's/^typo,4,,,30,/typo,4,,,,/' cases.csv
expect 4 organbake batch cases.csv --recipe r.yaml -o baked --progress json --quiet --no-pictures
expect_equal "$(checksums baked/one)" "$before"
[[ $(row one) == one,unchanged,0,* ]] || fail "one: $(row one)"
[[ $(row typo) == typo,written,0,* ]] || fail "typo: $(row typo)"
python3 - err <<'END' || fail "the progress is no JSON a line, or wrong: $(cat err)"
import json, sys
lines = [json.loads(line) for line in open(sys.argv[1])]
assert [l["event"] for l in lines].count("ended") == 20 and lines[0]["event"] == "started"
last = lines[-1]
assert (last["done"], last["failed"], last["running"], last["seconds_left"]) == (20, 4, 0, 0), last
END

# A case of a batch is the same as the bake alone; shards share a cache and don't meet, not even
# with another batch of the same cases at the same time.
expect 0 organbake bake r.yaml --set phantom.seed=1 -o alone
expect_same alone baked/one
head -n 4 cases.csv >good.csv
organbake batch good.csv --recipe r.yaml -o twin --no-pictures --cache shared >/dev/null 2>twin.log &
twin=$!
for i in 1 2; do
  expect 0 organbake batch good.csv --recipe r.yaml -o shards --shard $i/2 --no-pictures --cache shared
done
wait $twin || fail "of two batches with one cache, one failed: $(cat twin.log)"
for name in one 'two, with "quotes" & spaces' drei-für-alle; do
  expect_same "shards/$name" "baked/$name"
  expect_same "twin/$name" "baked/$name"
done
expect_equal "$(ls shards/*.json | xargs -n 1 basename | tr '\n' ' ')" "batch-1-of-2.json batch-2-of-2.json "
expect 0 organbake batch -o shards --gather 2
expect 0 organbake verify shards/batch.json
expect_equal "$(cut -d, -f1 shards/batch.csv | tr '\n' ' ')" "$(cut -d, -f1 twin/batch.csv | tr '\n' ' ')"
expect 66 organbake batch -o shards --gather 3
expect_err "has not ended"

# Several jobs start only as memory allows; with room for one they go one by one.
organbake batch good.csv --recipe r.yaml -o narrow --jobs 3 --memory 1 --no-pictures \
  --progress json >/dev/null 2>narrow.log || fail "with little memory: $(tail -n 1 narrow.log)"
grep -q '"running":[23]' narrow.log && fail "more ran at once than memory allows: $(cat narrow.log)"
organbake batch good.csv --recipe r.yaml -o wide --jobs 3 --no-pictures \
  --progress json >/dev/null 2>wide.log || fail "three jobs: $(tail -n 1 wide.log)"
grep -q '"running":3' wide.log || fail "three jobs never ran at once: $(cat wide.log)"

# Files by name.
mkdir scans && cp "$(ls p/ct.* | head -n 1)" scans/patient.7"$(ls p/ct.* | head -n 1 | sed 's/.*\/ct//')"
expect 0 organbake batch scans/* --recipe scan.yaml --set photos=p/photos/cameras.json -o byname
expect 0 organbake verify byname/patient.7

# A table as spreadsheets save it, in UTF-16.
printf 'case\tphantom.seed\r\none\t1\r\n' | iconv -f UTF-8 -t UTF-16 >unicode.txt
expect 0 organbake batch unicode.txt --recipe r.yaml -o saved --no-pictures
expect_same saved/one baked/one
touch cases.xlsx
expect 2 organbake batch cases.xlsx --recipe r.yaml -o x
expect_err "save its sheet as CSV"

# Wrong calls.
expect 2 organbake batch --recipe r.yaml -o x
expect 2 organbake batch good.csv -o x
expect 2 organbake batch good.csv --recipe r.yaml -o x --shard 3/2
touch "scans/$(printf 'a\nb')"
expect 2 organbake batch scans/a* --recipe scan.yaml -o x
expect_err "control character"
expect 66 organbake batch 'nothing/*.mha' --recipe scan.yaml -o x
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

# Nobody's table or bundle is lost to an -o.
mkdir own && printf 'case\na\n' >own/batch.csv && cp own/batch.csv kept.csv
expect 73 organbake batch own/batch.csv --recipe r.yaml -o own
expect_err "is the table of cases"
cmp -s own/batch.csv kept.csv || fail "the table of cases was overwritten"
expect 73 organbake batch kept.csv --recipe r.yaml -o baked/one
expect_err "is a bundle"
expect 0 organbake verify baked/one
