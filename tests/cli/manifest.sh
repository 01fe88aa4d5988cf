#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Manifests that lie, with a checksum of their own that is right: paths out of the bundle, absurd
# sizes, NaN. All refused with 65, none read.
source "$(dirname "$0")/assert.sh"
small_recipe >r.yaml
expect 0 organbake bake r.yaml -o good --set place.count=2

# lie PYTHON EXPECTED: changes the bundle `b` (a copy of `good`; m is its manifest), seals it anew.
lie() {
  rm -rf b && cp -r good b
  python3 - "$1" <<'END' || fail "the lie itself failed: $1"
import hashlib, json, pathlib, sys
b = pathlib.Path("b")
m = json.loads((b / "manifest.json").read_text())
def rehash(name, data):
    (b / name).write_bytes(data)
    for f in m["files"]:
        if f["path"] == name:
            f["bytes"], f["sha256"] = len(data), hashlib.sha256(data).hexdigest()
def edit(name, change):
    d = json.loads((b / name).read_text())
    change(d)
    rehash(name, json.dumps(d).encode())
exec(sys.argv[1])
m["manifest_sha256"] = "0" * 64
text = json.dumps(m, indent=2, ensure_ascii=False)
seal = hashlib.sha256(text.encode()).hexdigest()
(b / "manifest.json").write_text(text.replace('"manifest_sha256": "' + "0" * 64, '"manifest_sha256": "' + seal))
END
  expect 65 organbake verify b
  expect_err "$2"
  if [ -x "$BIN/organplay" ]; then
    expect 65 "$BIN/organplay" b --script "$WORK/script.json" --out frames
  fi
}
cat >script.json <<END
{"schema": "organbake/interaction/1", "name": "rest", "time_step_s": 0.02, "frames": 1,
 "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0}]}, "instruments": []}
END

lie 'm["files"][0]["path"] = "../outside"' "inside the bundle"
lie 'm["files"][0]["path"] = "/etc/passwd"' "inside the bundle"
lie 'm["files"][0]["path"] = "a/../../x"' "inside the bundle"
lie 'm["files"][0]["bytes"] = -1' "manifest.json"
lie 'm["files"][0]["bytes"] = 2**62' "manifest.json"
lie 'm["files"][0]["sha256"] = "xyz"' "manifest.json"
lie 'm["files"] = {}' "manifest.json"
lie 'm["schema"] = "organbake/bundle/99"' "manifest.json"
lie 'del m["recipe"]' "recipe"
lie 'sys.setrecursionlimit(5000)
m["recipe"] = []
for i in range(1000): m["recipe"] = [m["recipe"]]' "nested too deeply"
lie 'm["files"] = [f for f in m["files"] if f["path"] != "proxy.ply"]; (b / "proxy.ply").unlink()' "proxy.ply"
lie 'edit("cameras.json", lambda d: d["cameras"][0].update(width=46341, height=46341))' "46341"
lie 'edit("cameras.json", lambda d: d["cameras"][0].update(width=2**31))' "cameras.json"
lie 'edit("cameras.json", lambda d: d["cameras"][0].update(fx=0))' "cameras.json"
lie 'edit("cameras.json", lambda d: d["cameras"][0]["camera_from_world"]["rotation"][0].__setitem__(0, 7))' "cameras.json"
lie 'edit("cameras.json", lambda d: d["viewing_projection_manifold"]["triangles"].append([0, 1, 99]))' "cameras.json"
lie 'edit("cameras.json", lambda d: d.update(cameras=[]))' "cameras.json"
lie 'edit("mechanics.json", lambda d: d["springs"][0].update(a=10**6))' "mechanics.json"
lie 'edit("mechanics.json", lambda d: d["mass_kg"].__setitem__(0, -1))' "mechanics.json"
lie 'rehash("mechanics.json", (b / "mechanics.json").read_bytes().replace(b"\"instrument_radius_mm\": 5", b"\"instrument_radius_mm\": NaN"))' "mechanics.json"
lie 'import struct
d = bytearray((b / "proxy.ply").read_bytes())
at = d.index(b"end_header\n") + 11
d[at:at + 8] = struct.pack("<d", float("nan"))
rehash("proxy.ply", bytes(d))' "proxy.ply"
lie 'd = (b / "proxy.ply").read_bytes()
import re
rehash("proxy.ply", re.sub(rb"element vertex \d+", b"element vertex 2147483648", d))' "proxy.ply"
lie 'rehash("cam_000/depth.exr", (b / "cam_001/micro.exr").read_bytes())' "depth.exr"
lie 'rehash("base.exr", b"")' "base.exr"
true
