#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The centre of what a PLY surface of organbake encloses must lie within 0.1 mm of a point.
usage: surface_centre.py FILE X Y Z"""
import pathlib
import re
import struct
import sys

data = pathlib.Path(sys.argv[1]).read_bytes()
end = data.index(b'end_header\n') + len(b'end_header\n')
header = data[:end].decode()
vertices, faces = (int(re.search(rf'element {name} (\d+)', header).group(1)) for name in ('vertex', 'face'))
kinds = re.findall(r'property (\w+) \w+', header[:header.index('element face')])
form = struct.Struct('<' + ''.join({'double': 'd', 'float': 'f', 'uchar': 'B'}[k] for k in kinds))
points = [form.unpack_from(data, end + i * form.size)[:3] for i in range(vertices)]
corners = struct.Struct('<B3i')
volume, moment = 0.0, [0.0] * 3
for i in range(faces):
    _, *face = corners.unpack_from(data, end + vertices * form.size + i * corners.size)
    a, b, c = (points[v] for v in face)
    part = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    volume += part
    moment = [m + part * (x + y + z) / 4 for m, x, y, z in zip(moment, a, b, c)]
centre = [m / volume for m in moment]
off = sum((x - float(right)) ** 2 for x, right in zip(centre, sys.argv[2:])) ** 0.5
assert off < 0.1, f'{sys.argv[1]}: its centre is {centre}, {off:.3f} mm off'
