#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# What the program writes obeys its schemas, and what is wrong with a document is said.
source "$(dirname "$0")/assert.sh"
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
