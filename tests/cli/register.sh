#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A photograph's pose as users ask for it: files in, documents and pictures out, exit codes.
source "$(dirname "$0")/assert.sh"
expect 0 organbake phantom -o p --size-voxels 64,64,24 --spacing-mm 4,4,12 --photos 3 --photo-size-px 256 \
  --truth-subdivisions 5
photo=p/photos/photo_00.png
# Truth and how far a pose document is from it, in mm at the organ's centre.
off() {
  python3 - "$1" "$2" <<'END'
import json, sys
def camera(path, image):
    document = json.load(open(path))
    all = document["cameras"] + document.get("left_out", [])
    return [c for c in all if c["image"].endswith(image)][0]["camera_from_world"]
truth, found = camera("p/photos/cameras.json", sys.argv[2]), camera(sys.argv[1], sys.argv[2])
d = [sum((a - b) * c for a, b, c in zip(r, s, (17, -21, 33))) for r, s in zip(truth["rotation"], found["rotation"])]
print(sum((x + a - b) ** 2 for x, a, b in zip(d, truth["translation_mm"], found["translation_mm"])) ** 0.5)
END
}
at_most() { python3 -c "assert $1 <= $2" || fail "$3: $1 > $2"; }
lens() { python3 -c 'import json
c = json.load(open("p/photos/cameras.json"))["cameras"][0]
print(json.dumps({k: c[k] for k in ("width", "height", "fx", "fy", "cx", "cy")}))'; }
lens >K.json

# From a start, lit from somewhere: the studio's lamps are estimated.
code=0
organbake register p/truth.ply $photo --intrinsics K.json --init p/photos/cameras.json \
  --light estimated --vertex-albedo -o found/pose.json --json >out 2>err || code=$?
[ $code -eq 0 ] || [ $code -eq 3 ] || fail "exit code $code: $(cat err)"
at_most "$(off found/pose.json photo_00.png)" 2 "pose from the true start"
[ -s found/pose_overlay.png ] || fail "no overlay beside the pose"
expect 0 organbake verify found/pose.json

# The same bytes for any number of threads, and for other documents of the same start.
organbake register p/truth.ply $photo --intrinsics K.json --init p/photos/cameras.json \
  --light estimated --vertex-albedo -o alone/pose.json --threads 1 --force >out 2>err
expect_same found alone

# Cameras for and from other programs.
organbake register p/truth.ply $photo p/photos/photo_01.png --intrinsics K.json \
  --init p/photos/cameras.json --light estimated --also colmap -o both/pose.json >out 2>err
[ -e both/pose_overlay_photo_00.png ] && [ -e both/pose_overlay_photo_01.png ] ||
  fail "one overlay a photograph"
[ -s both/pose_colmap/cameras.txt ] && [ -e both/pose_colmap/images.txt ] || fail "no COLMAP model"

# A photograph that tells nothing: the result is written, the gate is not passed.
python3 - <<'END'
import struct, zlib
w = h = 64
rows = b"".join(b"\0" + bytes([90]) * (3 * w) for _ in range(h))
chunk = lambda t, d: struct.pack(">I", len(d)) + t + d + struct.pack(">I", zlib.crc32(t + d))
open("grey.png", "wb").write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", w, h, 8, 2, 0, 0, 0))
    + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
END
echo '{"width": 64, "height": 64, "fx": 100, "fy": 100, "cx": 32, "cy": 32}' >small.json
python3 -c 'import json
c = json.load(open("p/photos/cameras.json"))
c["cameras"] = c["cameras"][:1]
json.dump(c, open("start.json", "w"))'
expect 3 organbake register p/truth.ply grey.png --intrinsics small.json \
  --init start.json -o grey.json
expect_err "is failed"
expect 0 organbake verify grey.json
python3 -c 'import json
d = json.load(open("grey.json"))
assert not d["cameras"] and d["left_out"][0]["registration"]["verdict"] == "failed"' || fail "left_out"

# Depth takes part: of a surface seen from the photograph's camera, from a start that is off; and of
# relative maps. What is no depth of this photograph is refused.
mkdir seen
cp p/truth.ply seen/surface.ply
cp p/photos/cameras.json seen/cameras.json
python3 - <<'END'
import json
c = json.load(open("p/photos/cameras.json"))
for camera in c["cameras"]:
    camera["camera_from_world"]["translation_mm"][2] += 8
    camera["camera_from_world"]["translation_mm"][0] -= 5
json.dump(c, open("off.json", "w"))
END
code=0
organbake register p/truth.ply $photo --intrinsics K.json --init off.json --light estimated \
  --vertex-albedo --depth seen/surface.ply -o deep.json --json >out 2>err || code=$?
[ $code -eq 0 ] || [ $code -eq 3 ] || fail "exit code $code: $(cat err)"
at_most "$(off deep.json photo_00.png)" 1 "pose with depth"
python3 -c 'import json
d = json.load(open("deep.json"))
depth = (d["cameras"] + d.get("left_out", []))[0]["registration"]["depth"]
assert depth["agreeing_share"] > 0.9 and abs(depth["scale"] - 1) < 0.01, depth' || fail "depth's figures"
organbake shade $photo --intrinsics K.json -o shaded >out 2>err || true
[ -d shaded/depth ] || fail "no depth maps: $(cat err)"
code=0
organbake register p/truth.ply $photo --intrinsics K.json --init off.json --light estimated \
  --depth shaded -o relative.json >out 2>err || code=$?
[ $code -eq 0 ] || [ $code -eq 3 ] || fail "exit code $code: $(cat err)"
echo '{"width": 64, "height": 64, "fx": 400, "fy": 400, "cx": 32, "cy": 32}' >narrow.json
expect 65 organbake register p/truth.ply grey.png --intrinsics narrow.json --init start.json \
  --depth shaded -o x.json
expect_err "not one camera's"
mkdir metres none
python3 - <<'END'
lines = open("p/truth.ply", "rb").read()
head, body = lines.split(b"end_header\n", 1)
assert b"binary_little_endian" in head
import re, struct
count = int(re.search(rb"element vertex (\d+)", head)[1])
kinds = re.findall(rb"property (\w+) \w+", head.split(b"element face")[0])
form = "<" + "".join({b"double": "d", b"float": "f", b"uchar": "B", b"uint8": "B"}[k] for k in kinds)
size = struct.calcsize(form)
made = b"".join(struct.pack(form, *(v / 1000 if i < 3 else v for i, v in enumerate(row)))
                for row in struct.iter_unpack(form, body[:count * size]))
open("metres/surface.ply", "wb").write(head + b"end_header\n" + made + body[count * size:])
import json
cameras = json.load(open("p/photos/cameras.json"))
for camera in cameras["cameras"]:
    pose = camera["camera_from_world"]
    pose["translation_mm"] = [x / 1000 for x in pose["translation_mm"]]
json.dump(cameras, open("metres/cameras.json", "w"))
END
expect 65 organbake register p/truth.ply $photo --intrinsics K.json --init off.json \
  --depth metres/surface.ply -o x.json
expect_err "are they in another unit?"
echo nothing >none/notes.txt
expect 65 organbake register p/truth.ply $photo --intrinsics K.json --depth none -o x.json
expect_err "holds no depth map"
expect 2 organbake register p/truth.ply $photo --intrinsics K.json --init off.json \
  --depth seen/surface.ply --free-focal -o x.json
expect_err "where depth is known"

# What is wrong is named.
expect 65 organbake register p/truth.ply $photo --intrinsics small.json -o x.json
expect_err "small.json: is of pictures of 64x64"
expect 2 organbake register p/truth.ply --intrinsics K.json -o x.json
expect_err "lacks its input 'photo'"
expect 2 organbake register p/truth.ply $photo -o x.json
expect_err "lacks its input 'intrinsics'"
echo '{"width": 256, "height": 256, "fx": NaN}' >nan.json
expect 65 organbake register p/truth.ply $photo --intrinsics nan.json -o x.json
expect 66 organbake register p/truth.ply none.png --intrinsics K.json -o x.json
echo "1 2 3 4" >pairs.txt
expect 65 organbake register p/truth.ply $photo --intrinsics K.json --pairs pairs.txt -o x.json
expect_err "five numbers"
expect_gone x.json

# An OpenCV calibration counts from the first pixel's centre.
cat >K.yml <<'END'
%YAML:1.0
---
image_width: 64
image_height: 64
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 100., 0., 31.5, 0., 100., 31.5, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ 0., 0., 0., 0., 0. ]
END
expect 3 organbake register p/truth.ply grey.png --intrinsics K.yml \
  --init start.json -o yml.json
expect_equal "$(python3 -c 'import json; print(json.load(open("yml.json"))["left_out"][0]["cx"])')" 32.0
