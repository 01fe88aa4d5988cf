#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# organbake plan: commands that any shell runs as they are, whatever the files are called; estimates
# that hold; what can't fit is refused.
source "$(dirname "$0")/assert.sh"
odd="it's \"odd\" \$HOME \`x\` {1} *ü"
mkdir "$odd"
quick_recipe | sed '/^phantom/d' >"$odd/r.yaml"
for i in 1 2 3; do
  expect 0 organbake phantom --seed $i -o "p$i" --size-voxels 40,40,16 --photos 1 --photo-size-px 32 --truth-subdivisions 2
  cp "p$i/ct.mha" "$odd/scan $i; rm -rf '&' .mha"
done

# Every line by itself, as a shell reads it; then one table of all.
expect 0 organbake plan "$odd"/*.mha --recipe "$odd/r.yaml" -o "$odd/out" --emit lines --tasks 2 --no-pictures
expect_err "3 cases in 2 tasks"
cp out lines
expect_equal "$(wc -l <lines)" 2
while IFS= read -r line; do
  expect 0 sh -c "cd / && $line"
done <lines
expect 0 organbake batch -o "$odd/out" --gather 2
expect 0 organbake batch "$odd"/*.mha --recipe "$odd/r.yaml" -o direct --jobs 2 --no-pictures
for i in 1 2 3; do expect_same "$odd/out/scan $i; rm -rf '&' " "direct/scan $i; rm -rf '&' "; done

# The estimate is no less than what the bakes needed.
expect 0 organbake plan "$odd"/*.mha --recipe "$odd/r.yaml" -o planned --json
python3 - out direct/batch.json <<'END' || fail "the memory is estimated too low"
import json, sys
plan, batch = (json.load(open(name)) for name in sys.argv[1:])
needed = {case["case"]: case["peak_mb"] for case in batch["cases"]}
for case in plan["cases"]:
    assert case["flaw"] == "" and case["cpu_seconds"] > 0, case
    assert needed[case["case"]] <= case["memory_mb"] <= 4 * needed[case["case"]] + 100, (case, needed)
END

# The other engines' scripts are well-formed (scripts/test_cluster runs them).
expect 0 organbake plan "$odd"/*.mha --recipe "$odd/r.yaml" -o "$odd/out" --emit slurm --tasks 9
expect_out "#SBATCH --array=1-3"
bash -n out || fail "the array's script is no shell script"
expect 0 organbake plan "$odd"/*.mha --recipe "$odd/r.yaml" -o "$odd/out" --emit snakemake
python3 -c 'import sys; config = {}; text = open(sys.argv[1]).read(); exec(text[:text.index(")\n\n") + 1])
assert config["output"].endswith(sys.argv[2] + "/out"), config' out "$odd" || fail "the Snakefile's configuration: $(head -n 20 out)"

# What can't fit, can't be said in a line, or will fail.
truncate -s 200G big.nii
expect 2 organbake plan big.nii --recipe "$odd/r.yaml" -o x
expect_err "case 'big' needs about"
expect_err "give --memory"
expect 2 organbake plan "$odd"/*.mha --recipe "$odd/r.yaml" -o x --hours 0.001 --set place.size_px=4096
expect_err "--hours allows"
touch "$(printf 'a\nb.mha')" && mkdir "$(printf 'c\nd')" && cp p1/ct.mha "$(printf 'c\nd')/e.mha"
expect 2 organbake plan "$(printf 'a\nb.mha')" --recipe "$odd/r.yaml" -o x
expect 2 organbake plan "$(printf 'c\nd')/e.mha" --recipe "$odd/r.yaml" -o x
expect_err "line break"
expect 2 organbake plan --recipe "$odd/r.yaml" -o x
expect 66 organbake plan p1/ct.mha --recipe none.yaml -o x
expect 2 organbake plan p1/ct.mha --recipe "$odd/r.yaml" -o x --emit pbs
expect_gone x
expect 0 organbake plan nowhere.mha p1/ct.mha --recipe "$odd/r.yaml" -o y
expect_err "case 'nowhere' will fail: nowhere.mha: does not exist"
