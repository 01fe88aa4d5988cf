#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# What everybody gets wrong once, and what is said: the file or option, its value, what to do. One
# sentence each, a documented exit code, nothing left behind.
source "$(dirname "$0")/assert.sh"
organplay() { "$BIN/organplay" "$@"; }
small_phantom p
small_recipe >r.yaml
expect 0 organbake bake r.yaml -o b --quiet
mkdir empty
echo "case,ct" >head.csv
printf 'case,ct\none,p/ct.mha,5\n' >long.csv
printf 'decimate: {faces: 60}\n' >bare.yaml
printf 'schema: organbake/recipe/1\ndecimate: {facs: 60}\n' >key.yaml
printf 'schema: organbake/recipe/1\ndecimate: {faces: lots}\n' >value.yaml
printf 'schema: organbake/recipe/1\n decimate: {faces: 60\n' >yaml.yaml
echo '{"frames": 3}' >script.json
cp -r b torn && rm torn/proxy.ply
head -c 2000 b/cameras.json >cameras.json
head -c 2000 p/ct.mha >cut.nii

# CODE | WHAT IS SAID, its parts split by ~ | COMMAND
while IFS='|' read -r code said command; do
  [ -n "${command// /}" ] || continue
  expect $code bash -c "organbake() { '$BIN/organbake' \"\$@\"; }; organplay() { '$BIN/organplay' \"\$@\"; }; $command --quiet"
  while IFS= read -r part; do expect_err "$part"; done < <(tr '~' '\n' <<<"${said# }" | sed 's/ *$//')
  expect_sentence
  expect_gone made
  expect_gone made.png; expect_gone made.json
done <<'END'
2  | unknown command 'bakke'~did you mean 'bake'?                      | organbake bakke r.yaml -o made
2  | unknown flag --face~did you mean '--faces'?                       | organbake decimate p/truth.ply -o made --face 80
2  | --faces: 'many' is not possible~4…10000000                        | organbake decimate p/truth.ply -o made --faces many
2  | --faces: '2' is not possible~4…10000000                           | organbake decimate p/truth.ply -o made --faces 2
2  | --method: 'quadrik'~did you mean 'quadric'?                       | organbake decimate p/truth.ply -o made --method quadrik
2  | -o is missing: where shall the result go?                         | organbake decimate p/truth.ply
2  | -o is missing: where shall the bundle go?                         | organbake bake r.yaml
2  | 'organbake bake' needs a recipe~organbake recipes                 | organbake bake -o made
66 | livr: is neither~did you mean 'liver'?                            | organbake bake livr -o made
66 | none.yaml: is neither~organbake recipes                           | organbake bake none.yaml -o made
2  | p/ct.mha is a volume, not a recipe~--set ct=p/ct.mha -o BUNDLE    | organbake bake p/ct.mha -o made
2  | b is a bundle, baked already~'organplay'                          | organbake bake b -o made
2  | head.csv is a table of cases~organbake batch head.csv             | organbake bake head.csv -o made
78 | bare.yaml~schema                                                  | organbake bake bare.yaml -o made
78 | key.yaml:2: unknown key 'decimate.facs'~did you mean 'faces'?     | organbake bake key.yaml -o made
78 | value.yaml:2: decimate.faces is "lots"~at least 4                                          | organbake bake value.yaml -o made
78 | yaml.yaml:                                                        | organbake bake yaml.yaml -o made
78 | --set decimat.faces=60~did you mean 'decimate'?                   | organbake bake r.yaml -o made --set decimat.faces=60
78 | --set faces=60: 'faces' belongs to a section; say decimate.faces  | organbake bake r.yaml -o made --set faces=60
78 | --set faces: it takes key=value                                   | organbake bake r.yaml -o made --set faces
66 | gone.png~there is no such file                                  | organbake shade gone.png -o made --from-previous 1 --full-relief 1
66 | gone.nii.gz: there is no such file                                | organbake bake r.yaml -o made --set ct=gone.nii.gz
78 | there is no mask~mask=FILE                                        | organbake bake r.yaml -o made --set label=liver
65 | p/ct.mha: holds values down to −~swapped                           | organbake isosurface --mask p/ct.mha --label 5 -o made
65 | cut.nii                                                           | organbake isosurface cut.nii -o made
66 | empty: is an empty folder                                         | organbake isosurface empty -o made
73 | is a folder                                                       | organbake decimate p/truth.ply -o p
2  | BUNDLE is missing: what to play                                   | organplay --sheet made.png
66 | gone: there is no such folder                                        | organplay gone --sheet made.png
65 | torn~proxy.ply                                                    | organplay torn --sheet made.png
65 | script.json~schema                                                | organplay b --script script.json --report made.json
66 | pok: is neither a file~did you mean 'poke'?                       | organplay b --script pok --report made.json
66 | scop.json: is neither a file~did you mean 'scope'?                | organplay b --scope scop.json -o made.png
2  | b/. is given twice~in its place once                             | organplay b b/. --sheet made.png
2  | --view-deg 0,0,0.01~at least 0.1~--distance-mm                    | organplay b --view-deg 0,0,0.01 -o made.png
2  | --distance-mm: '0.06' is not possible~1…10000                     | organplay b --distance-mm 0.06 -o made.png
2  | a baseline of 0.005 mm makes no stereo                            | organplay b --stereo-mm 0.005 -o made.png
2  | range_mm is 0.06~60, not 0.06                                     | organbake motion p/photos --range-mm 0.06 -o made
2  | shaft_mm is 0.005~it is in mm                                     | organbake motion p/photos --shaft-mm 0.005 -o made
2  | range_mm is 0.06~60, not 0.06                                     | organbake shade p/photos --range-mm 0.06 -o made
73 | /proc/made.ply: cannot be written: /proc                          | organbake decimate p/truth.ply -o /proc/made.ply
73 | /proc/made: cannot be written: /proc                              | organbake bake r.yaml -o /proc/made
73 | /proc: cannot be written to                                       | organplay b --sheet /proc/made.png
2  | --script needs --out DIR, --video FILE                            | organplay b --script script.json
2  | --size big is no size~1280x720                                        | organplay b --size big -o made
2  | --view-deg left is no view~AZIMUTH,ELEVATION                                                 | organplay b --view-deg left -o made
65 | head.csv: the table holds no case                                  | organbake batch head.csv --recipe r.yaml -o made
65 | long.csv:2: 3 fields, but the header has 2                        | organbake batch long.csv --recipe r.yaml -o made
2  | --recipe is missing                                               | organbake batch head.csv -o made
END
true
