#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# data-schemas/ is what the program itself prints, and what it writes obeys it.
source "$(dirname "$0")/assert.sh"
expect 0 organbake schema
cp out names
expect_equal "$(cat names)" "$(cd "$SOURCE/data-schemas" && ls *.schema.json | sed 's/\.schema\.json$//' | sort)"
while read -r name; do
  organbake schema "$name" >printed || fail "schema $name"
  cmp -s printed "$SOURCE/data-schemas/$name.schema.json" ||
    fail "organbake schema $name > data-schemas/$name.schema.json is due"
done <names

small_phantom p
small_recipe >r.yaml
expect 0 organbake bake r.yaml -o b
for document in p/phantom.json p/report.json p/photos/cameras.json b/cameras.json \
  b/mechanics.json b/report.json r.yaml b; do
  expect 0 organbake verify $document
done
sed 's/"fx"/"fy"/' b/cameras.json >bad.json
expect 65 organbake verify bad.json
expect_err "bad.json:"
echo '{"schema": "organbake/cameras/1", "cameras": [], "extra": 1}' >bad.json
expect 65 organbake verify bad.json
expect_err "unknown key 'extra'"
printf '{\n "schema": "organbake/cameras/1",\n "cameras": [}\n' >bad.json
expect 65 organbake verify bad.json
expect_err "line 3"
echo '{"a": 1}' >bad.json
expect 65 organbake verify bad.json
expect_err "has no key 'schema'"
# A document may have any name.
{ echo; cat b/cameras.json; } >cameras.txt
expect 0 organbake verify cameras.txt
