#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Errors of recipes and settings: code 78, the line, the key, and the nearest one.
source "$(dirname "$0")/assert.sh"

bad_recipe() {  # TEXT-OF-RECIPE EXPECTED [ARGUMENTS…]
  printf 'schema: organbake/recipe/1\n%s\n' "$1" >r.yaml
  expect 78 organbake bake r.yaml -o made --quiet "${@:3}"
  expect_err "$2"
  expect_sentence
  expect_gone made
}

bad_recipe $'\n\nplce: {count: 3}' "r.yaml:4: unknown key 'plce'; did you mean 'place'?"
bad_recipe $'decimate:\n  faces: 2' "r.yaml:3: decimate.faces is 2; it must be a number, at least 4, at most 10000000, or auto"
bad_recipe $'isosurface: {iso: -300\nplace: {}' "r.yaml:"
bad_recipe 'name: nothing to bake' "lacks its input 'ct'"
bad_recipe 'phantom: {}' "did you mean 'faces'?" --set decimate.face=9
bad_recipe 'phantom: {}' "unit is said of the inputs, but no step of this bake reads it" --unit cm
echo "just words" >r.yaml
expect 78 organbake bake r.yaml -o made
expect_err "is not a recipe"
head -c 2000 /dev/urandom >r.yaml
expect 78 organbake bake r.yaml -o made
expect 66 organbake bake missing.yaml -o made
expect 2 organbake bake . -o made
expect_err "is a folder, not a recipe; write: organbake bake"
expect 2 organbake bake "$SOURCE/pipelines/recipes/phantom.yaml"
expect_err "-o is missing"
expect 2 organbake bake "$SOURCE/pipelines/recipes/phantom.yaml" -o made --to nonsense
bad_recipe 'quality: best' 'r.yaml:2: quality is "best"'
bad_recipe 'phantom: {}' "one of" --set quality=best
expect 2 organbake bake r.yaml -o made --quality best
expect_err "one of draft, standard, fine"
small_recipe >r.yaml
expect 0 organbake bake r.yaml --dry-run --explain --quality draft
expect_out '"rays_per_texel_side":1'
expect_out "place.count of quality draft: left out, the recipe says 4"
for recipe in phantom liver abdomen; do
  expect 0 organbake verify "$SOURCE/pipelines/recipes/$recipe.yaml"
  expect 0 organbake inspect "$SOURCE/pipelines/recipes/$recipe.yaml"
done
expect_gone made
