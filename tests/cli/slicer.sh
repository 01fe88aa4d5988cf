#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# 'organbake STAGE --xml' is what 3D Slicer's execution model takes, tells every option that the
# stage has, and the arguments that Slicer makes of it run the stage.
source "$(dirname "$0")/assert.sh"
command -v xmllint >/dev/null || { echo "SKIPPED: xmllint is not installed"; exit 0; }

stages=$(organbake --help | sed -n '/^Stages:/,/^Commands:/s/^  \([a-z]*\) .*/\1/p')
[ "$(wc -w <<<"$stages")" -ge 11 ] || fail "only these stages are listed: $stages"
for stage in $stages; do
  expect 0 organbake $stage --xml
  cp out $stage.xml
  xmllint --noout --schema "$SOURCE/tests/cli/slicer_module.xsd" $stage.xml 2>err ||
    fail "$stage: $(grep -v 'fails to validate' err | head -3)"
  # Every flag of its own help but those that only a terminal has a use for.
  for flag in $(organbake $stage --help | sed -n '/^Shared/q;s/^  \(-., \)\?\(--[a-z0-9-]*\).*/\2/p'); do
    [[ $flag =~ ^--(force|cache|xml|strict)$ ]] && continue
    grep -qE -- "<longflag>(--no-${flag#--}|$flag)</longflag>" $stage.xml ||
      fail "$stage: Slicer is not told of $flag"
  done
done

# The defaults written out, as Slicer passes them, make what no argument at all makes.
small_phantom p
arguments=$(python3 - <<'PY'
import xml.etree.ElementTree as tree
for parameter in tree.parse("isosurface.xml").iter():
    flag, default = parameter.find("longflag"), parameter.find("default")
    if flag is None or default is None or parameter.tag == "boolean": continue
    if parameter.tag == "string" and not default.text: continue
    print(flag.text, default.text)
PY
)
[ "$(wc -l <<<"$arguments")" -ge 8 ] || fail "too few defaults: $arguments"
expect 0 organbake isosurface p/ct.mha -o plain.ply
expect 0 organbake isosurface --ct p/ct.mha $arguments --output slicer.ply --force
expect_same plain.ply slicer.ply

# Through what Slicer starts, with the environment that it starts it in.
expect 0 cmake --install "$BIN/.." --component organbake --prefix "$WORK/prefix"
expect_equal "$(ls prefix/lib/organbake/slicer | wc -w)" "$(wc -w <<<"$stages")"
mkdir other && : >other/libstdc++.so.6
expect 0 env LD_LIBRARY_PATH="$WORK/other" prefix/lib/organbake/slicer/organbake_isosurface --xml
expect_same out isosurface.xml
