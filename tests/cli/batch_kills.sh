#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# kill -9 of a batch or of one of its workers at random moments: a batch survives its workers, and a
# rerun ends in the same bytes and redoes only what was not finished. ORGANBAKE_KILLS=20 for the long
# form.
source "$(dirname "$0")/assert.sh"
quick_recipe >r.yaml
printf 'case,phantom.seed\none,1\ntwo,2\nthree,3\nfour,4\n' >cases.csv
batch=("$BIN/organbake" batch cases.csv --recipe r.yaml --jobs 2 --no-pictures --quiet)
killed=("${batch[@]}" -o killed --cache cache)
start=$(milliseconds)
expect 0 "${batch[@]}" -o whole --cache whole-cache
total=$(($(milliseconds) - start))

wait_for_worker() { while kill -0 "$1" 2>/dev/null && [ -z "$(pgrep -P "$1")" ]; do sleep 0.02; done; }
RANDOM=${ORGANBAKE_SEED:-11}
for i in $(seq "${ORGANBAKE_KILLS:-4}"); do
  rm -rf killed cache
  "${killed[@]}" >/dev/null 2>killed.log &
  pid=$!
  moment=$((RANDOM % total))
  sleep_ms $moment
  if [ $((i % 2)) -eq 0 ]; then
    # One worker: it is tried again, and nothing is missing in the end.
    worker=$(pgrep -P $pid | shuf -n 1 --random-source=<(yes $i))
    [ -n "$worker" ] && kill -9 "$worker" 2>/dev/null
    wait $pid || fail "the batch did not survive the loss of a worker: $(cat killed.log)"
  else
    kill -9 $pid 2>/dev/null
    wait $pid 2>/dev/null
  fi
  finished=$(cd killed 2>/dev/null && ls -d */manifest.json 2>/dev/null | cut -d/ -f1 | sort | tr '\n' ' ')
  expect 0 "${killed[@]}"
  expect_equal "$(grep ',unchanged,' killed/batch.csv | cut -d, -f1 | sort | tr '\n' ' ')" "$finished"
  expect_equal "$(grep -c ',written,\|,unchanged,' killed/batch.csv)" 4
  for name in one two three four; do expect_same "whole/$name" "killed/$name"; done
  expect_equal "$(leftovers killed)" ""
done

# Asked to stop, it stops its workers, says so, and leaves a table.
rm -rf killed cache
"${killed[@]}" >/dev/null 2>err &
pid=$!
wait_for_worker $pid
kill -TERM $pid
wait $pid
expect_equal $? 130
[ -s killed/batch.csv ] || fail "no table of an interrupted batch"

# So it does when a case has failed already and it only waits for the others.
printf 'case,isosurface.iso,phantom.size_voxels\nbroken,3000,\nlong,,"200,200,200"\n' >mixed.csv
rm -rf killed cache
"$BIN/organbake" batch mixed.csv --recipe r.yaml --jobs 2 --no-pictures --no-keep-going \
  --progress json --quiet -o killed --cache cache >/dev/null 2>err &
pid=$!
while kill -0 $pid 2>/dev/null && ! grep -q '"failed":1' err; do sleep 0.02; done
kill -TERM $pid
wait $pid
expect_equal $? 130
if grep -q '^long,written' killed/batch.csv; then fail "the long case was not stopped"; fi
