#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Lenses as people hand them over: what cannot be meant is refused by name wherever a lens is taken,
# fisheyes are straightened and that is said, and tissue is shown upright as it was filmed.
source "$(dirname "$0")/assert.sh"

expect 0 organbake phantom --kind laparoscopy --baseline-mm 4.5 --tilt-deg 30 --texture 0.3 --frames 1 \
  --frame-width-px 360 --frame-height-px 288 -o p
frame=p/frames/000000.png right=p/right/000000.png
python3 - <<'END'
import json, struct, zlib
left, right = json.load(open("p/stereo.json"))["cameras"]
def matrix(name, values, rows, columns):
    return (f"{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n"
            f"   data: [ {', '.join(repr(float(v)) for v in values)} ]\n")
def k(c, scale=1): return [c["fx"] * scale, 0, (c["cx"] - .5) * scale, 0, c["fy"] * scale,
                           (c["cy"] - .5) * scale, 0, 0, 1]
bent = [-.3, .12, .001, -.002, .05]
head = "%YAML:1.0\n---\n"
def lens(name, camera, d, columns, more=""):
    open(name, "w").write(head + matrix("camera_matrix", camera, 3, 3) +
                          matrix("distortion_coefficients", d, 1, columns) + more)
lens("lens_5.yml", k(left), bent, 5)
lens("lens_5_as_4.yml", k(left), bent, 4)
lens("lens_nan.yml", k(left), [-.3, float("nan"), 0, 0, 0], 5)
lens("lens_3.yml", k(left), bent[:3], 3)
lens("lens_rational.yml", k(left), bent + [.1, 0, 0], 8, "distortion_model: rational_polynomial\n")
lens("lens_normalised.yml", [.95, 0, .5, 0, .95, .5, 0, 0, 1], [0] * 5, 5)
lens("lens_halved.yml", k(left, 0.5), [0] * 5, 5)
lens("lens_small.yml", k(left, 0.5), [0] * 5, 5, "image_width: 180\nimage_height: 144\n")
lens("fisheye.yml", k(left, 0.7), [-.01, .002, 0, 0], 4, "distortion_model: equidistant\n")
def stereo(name, columns):
    open(name, "w").write(head + matrix("K1", k(left), 3, 3) + matrix("D1", bent, 1, columns) +
                          matrix("K2", k(right), 3, 3) + matrix("D2", bent, 1, columns) +
                          matrix("R", [1, 0, 0, 0, 1, 0, 0, 0, 1], 3, 3) +
                          matrix("T", [-4.5, 0, 0], 3, 1))
stereo("stereo_5_as_4.yml", 4)
open("lens.npz", "wb").write(b"PK\x03\x04" + bytes(60))
open("lens.mat", "wb").write(b"MATLAB 5.0 MAT-file, Platform: GLNXA64" + bytes(90))
open("calib_results.txt", "w").write("#polynomial coefficients for the DIRECT mapping function "
                                     "(ocam_model.ss in MATLAB)\n5 -380 0 1e-3 0 0\n")
def png(name, white):
    width, height = 360, 288
    rows = b"".join(b"\0" + bytes(255 * white(x, y) for x in range(width)) for y in range(height))
    part = lambda kind, data: (struct.pack(">I", len(data)) + kind + data +
                               struct.pack(">I", zlib.crc32(kind + data)))
    open(name, "wb").write(b"\x89PNG\r\n\x1a\n" +
                           part(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)) +
                           part(b"IDAT", zlib.compress(rows)) + part(b"IEND", b""))
png("tissue_white.png", lambda x, y: not (x > 220 and abs(y - 140) < 30))
png("third_white.png", lambda x, y: x > 240)
END

# Distortion that cannot be read, and lenses of other pictures: in every stage that takes a lens.
expect 0 organbake shade $frame lens_5.yml --halvings 0 -o bent
for taker in "shade $frame --intrinsics" "register bent/surface.ply $frame --intrinsics"; do
  refused 65 "its 'distortion_coefficients' says 1 rows and 4 columns" \
    organbake $taker lens_5_as_4.yml -o made
  refused 65 "lens_nan.yml" organbake $taker lens_nan.yml -o made
  refused 65 "has 3 numbers" organbake $taker lens_3.yml -o made
  refused 65 "no rational model" organbake $taker lens_rational.yml -o made
  refused 65 "has a focal length of 0.95" organbake $taker lens_normalised.yml -o made
  refused 65 "far off the middle" organbake $taker lens_halved.yml -o made
  refused 65 "is of pictures of 180x144" organbake $taker lens_small.yml -o made
  refused 65 "NumPy archive" organbake $taker lens.npz -o made
  refused 65 "MATLAB file" organbake $taker lens.mat -o made
  refused 65 "OCamCalib" organbake $taker calib_results.txt -o made
done
refused 65 "its 'D1' says 1 rows and 4 columns" \
  organbake stereo $frame $right stereo_5_as_4.yml -o made
refused 65 "NumPy archive" organbake stereo $frame $right lens.npz -o made

# A fisheye is straightened, and that is said.
expect 0 organbake shade $frame fisheye.yml --halvings 0 -o fish
expect_err "the lens is a fisheye of"

# Masks that hide the tissue.
expect 0 organbake shade $frame --instruments tissue_white.png --halvings 0 -o inverted
expect_err "% of the picture: is it inverted?"
expect 0 organbake shade $frame --instruments third_white.png --halvings 0 -o third
expect_err "the mask of instruments hides 33 % of the picture"
grep -q "inverted" err && fail "a third of the picture is taken for an inverted mask"

# Upright as filmed: camera 0's up is the frame's.
expect 0 organbake phantom --kind laparoscopy --frames 1 --frame-width-px 320 --frame-height-px 240 -o clip
expect 0 organbake bake "$SOURCE/pipelines/recipes/laparoscopy.yaml" --set frames=clip/frames \
  --quality draft -o tissue
python3 - <<'END' || fail "the tissue does not stand upright"
import json
rotation = json.load(open("tissue/cameras.json"))["cameras"][0]["camera_from_world"]["rotation"]
assert rotation[1][1] > 0.999 and rotation[0][0] > 0.999, rotation
END
expect_equal "$(leftovers "$WORK")" ""
