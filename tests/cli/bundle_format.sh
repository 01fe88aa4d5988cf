#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The reader that data-schemas/bundle-format.md prints reads a bundle, and finds the organ where it
# is. The patch of the manual's worked example still applies.
source "$(dirname "$0")/assert.sh"
quick_recipe >r.yaml
expect 0 organbake bake r.yaml --set bundle.surface=true -o b
sed -n '/^```python$/,/^```$/{/^```/d;p}' "$SOURCE/data-schemas/bundle-format.md" >reader.py
[ "$(wc -l <reader.py)" -gt 40 ] || fail "the page holds no reader"
expect 0 python3 reader.py b
cp out read
# The depth of a picture, which is packed otherwise, lies on the organ, too.
expect 0 "$BIN/organplay" b --quiet --size 96x72 -o drawn.png --layers depth
mkdir -p drawn/cam_000
cp drawn_cameras.json drawn/cameras.json
cp drawn_depth.exr drawn/cam_000/depth.exr
python3 - <<'PY' || fail "the points of camera 0: $(cat read)"
import re, struct, sys
sys.argv = ["reader", "b"]
exec(open("reader.py").read())  # leaves the points in `seen`

# The baked surface: doubles, then float colours; then faces of three corners.
data = open("b/surface.ply", "rb").read()
end = data.index(b"end_header\n") + 11
header = data[:end].decode()
stride = 24 + (12 if "float red" in header else 0)
count = int(re.search(r"element vertex (\d+)", header)[1])
vertices = [struct.unpack_from("<3d", data, end + i * stride) for i in range(count)]
faces = [struct.unpack_from("<xiii", data, end + count * stride + 13 * f)
         for f in range(int(re.search(r"element face (\d+)", header)[1]))]
distance = lambda a, b: sum((x - y) ** 2 for x, y in zip(a, b)) ** 0.5
longest = max(distance(vertices[f[k]], vertices[f[k - 1]]) for f in faces for k in range(3))

assert len(seen) > 48 * 48 / 5, len(seen)  # the organ fills a good part of the picture
drawn = list(points(pathlib.Path("drawn"), 0))
assert len(drawn) > 96 * 72 / 10, len(drawn)
for point in seen[::20] + drawn[::20]:
    # A point on the surface is nearer to a corner of its face than its longest edge is long.
    assert min(distance(point, v) for v in vertices) < longest, point
shares = sorted((max(p[k] for p in seen) - min(p[k] for p in seen)) /
                (max(v[k] for v in vertices) - min(v[k] for v in vertices)) for k in range(3))
# One camera sees the organ's front: most of its width and height, a part of its depth.
assert 0.2 < shares[0] and 0.6 < shares[1] and shares[2] < 1.001, shares
PY
# A changed byte is found.
printf x | dd of=b/base.exr bs=1 seek=999 conv=notrunc 2>/dev/null
expect 1 python3 reader.py b
expect_err base.exr

if [ -d "$SOURCE/.git" ] || [ -f "$SOURCE/.git" ]; then
  (cd "$SOURCE" && git apply --check apps/manual/mirror_stage.patch) 2>err || fail "$(cat err)"
fi
