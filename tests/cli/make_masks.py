#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The inputs of masks_and_volumes.sh, each of a known shape. usage: make_masks.py FOLDER"""
import json
import math
import struct
import sys
from pathlib import Path

SIZE, SPACING, ORIGIN = (80, 64, 40), (1.2, 1.2, 2.5), (-56.0, -36.0, 46.0)
CODES = {'B': (2, 8), 'h': (4, 16), 'f': (16, 32), 'd': (64, 64), 'H': (512, 16)}


def voxels(value, size=SIZE, spacing=SPACING, origin=ORIGIN):  # x runs fastest
    xs, ys, zs = ([origin[a] + spacing[a] * i for i in range(size[a])] for a in range(3))
    return [value(x, y, z) for z in zs for y in ys for x in xs]


def nifti(path, values, code='B', size=SIZE, spacing=SPACING, origin=ORIGIN, times=1):
    head = bytearray(352)
    struct.pack_into('<i', head, 0, 348)
    struct.pack_into('<8h', head, 40, 3 if times == 1 else 4, *size, times, 1, 1, 1)
    struct.pack_into('<2h', head, 70, *CODES[code])
    struct.pack_into('<8f', head, 76, 1, *spacing, 1, 1, 1, 1)
    struct.pack_into('<2f', head, 108, 352, 1)
    head[123] = 2
    struct.pack_into('<h', head, 254, 1)
    rows = [(-spacing[0], 0, 0, -origin[0]), (0, -spacing[1], 0, -origin[1]), (0, 0, spacing[2], origin[2])]
    for row, numbers in enumerate(rows):  # RAS
        struct.pack_into('<4f', head, 280 + 16 * row, *numbers)
    head[344:347] = b'n+1'
    path.write_bytes(bytes(head) + struct.pack(f'<{len(values)}{code}', *values))


def ellipsoid(centre, radii):
    return lambda *p: sum(((p[a] - centre[a]) / radii[a]) ** 2 for a in range(3)) < 1


organ = ellipsoid((-8, 2, 96), (30, 25, 18))  # 56.55 ml
left, right = ellipsoid((-34, 2, 96), (17, 20, 24)), ellipsoid((16, 2, 96), (17, 20, 17))


def images(folder):
    inside = voxels(organ)
    nifti(folder / 'ct.nii', [100 if i else -60 for i in inside], 'h')
    nifti(folder / 'mask.nii', [int(i) for i in inside])
    nifti(folder / 'mask_double.nii', [float(i) for i in inside], 'd')
    nifti(folder / 'mask_nan.nii', [1.0 if i else math.nan for i in inside], 'f')
    nifti(folder / 'wide.nii', [40000 if i else 0 for i in inside], 'H')
    nifti(folder / 'one_hot.nii', [int(not i) for i in inside] + [int(i) for i in inside], times=2)
    shifted = (ORIGIN[0] + 0.5, ORIGIN[1] - 0.4, ORIGIN[2] + 1.2)
    nifti(folder / 'mask_shifted.nii', [int(i) for i in voxels(organ, origin=shifted)], origin=shifted)
    nifti(folder / 'far.nii', [int(i) for i in inside], origin=(900, 900, 900))
    two = voxels(lambda *p: 1 if left(*p) else 2 if right(*p) else 0)
    nifti(folder / 'kidneys.nii', [int(i > 0) for i in two])
    nifti(folder / 'two_labels.nii', two)
    (folder / 'organs').mkdir()
    nifti(folder / 'organs' / 'liver.nii', [int(i) for i in inside])
    nifti(folder / 'organs' / 'kidneys.nii', [int(i > 0) for i in two])
    half = (40, 40, 17)
    ball = voxels(ellipsoid((0, 0, 0), (16, 16, 16)), half, (1, 1, 1), (-19.5, -19.5, -19.5))
    nifti(folder / 'half.nii', [int(i) for i in ball], size=half, spacing=(1, 1, 1), origin=(-19.5, -19.5, -19.5))
    size, origin = (80, 80, 80), (-39.5, -39.5, -39.5)  # level L at radius 30 + 2 ln(1/L - 1)
    edge = voxels(lambda x, y, z: 1 / (1 + math.exp((math.hypot(x, y, z) - 30) / 2)), size, (1, 1, 1), origin)
    nifti(folder / 'zero_to_one.nii', [round(e, 4) for e in edge], 'f', size, (1, 1, 1), origin)


def names(folder):
    for name, labels in {'dataset.json': {'background': 0, 'liver': 1}, 'dataset_1.json': {'0': 'background', '1': 'liver'},
                         'regions.json': {'background': 0, 'kidneys': [1, 2], 'right': 2}, 'broken.json': {'liver': 'one'}}.items():
        (folder / name).write_text(json.dumps({'channel_names': {'0': 'CT'}, 'labels': labels}))


# ---- DICOM: explicit VR, little endian; the value of an SQ is a list of encoded items
def element(tag, vr, value):
    if vr == 'SQ':
        value = b''.join(struct.pack('<2HI', 0xFFFE, 0xE000, len(item)) + item for item in value)
    elif isinstance(value, int):
        value = struct.pack('<H', value)
    elif isinstance(value, str):
        value = value.encode()
    value += (b'\0' if vr in ('UI', 'OB') else b' ') * (len(value) % 2)
    length = struct.pack('<HI', 0, len(value)) if vr in ('SQ', 'OB', 'OW') else struct.pack('<H', len(value))
    return struct.pack('<2H', tag >> 16, tag & 0xFFFF) + vr.encode() + length + value


def elements(*rows):
    return b''.join(element(*row) for row in rows)


def dicom(path, kind, *rows):
    meta = elements((0x00020001, 'OB', b'\0\1'), (0x00020002, 'UI', kind), (0x00020003, 'UI', '2.25.7'), (0x00020010, 'UI', '1.2.840.10008.1.2.1'))
    path.write_bytes(bytes(128) + b'DICM' + element(0x00020000, 'UL', struct.pack('<I', len(meta))) + meta +
                     elements((0x00080016, 'UI', kind), (0x00080018, 'UI', '2.25.7'), *rows))


def structure_set(path, regions):  # (name, contours of (x, y, z) points)
    listed = [elements((0x30060022, 'IS', str(n)), (0x30060026, 'LO', name)) for n, (name, _) in enumerate(regions, 1)]
    drawn = []
    for n, (_, contours) in enumerate(regions, 1):
        items = [elements((0x30060042, 'CS', 'CLOSED_PLANAR'), (0x30060046, 'IS', str(len(c))),
                          (0x30060050, 'DS', '\\'.join('%.3f' % x for p in c for x in p))) for c in contours]
        drawn.append(elements((0x30060040, 'SQ', items), (0x30060084, 'IS', str(n))))
    dicom(path, '1.2.840.10008.5.1.4.1.1.481.3', (0x00080060, 'CS', 'RTSTRUCT'), (0x30060020, 'SQ', listed), (0x30060039, 'SQ', drawn))


def circle(x, radius, z, first=0, step=1):
    angles = [2 * math.pi * (first + step * i) / 180 for i in range(180)]
    return [(x + radius * math.cos(a), radius * math.sin(a), z) for a in angles]


def contours(folder):  # 20 planes at 2.5 mm
    planes = [70 + 2.5 * k for k in range(20)]
    discs = [circle(0, 25, z) for z in planes]
    structure_set(folder / 'contours.dcm', [
        ('UNION', discs + [circle(25, 15, z) for z in planes]),
        ('TWICE', discs + [circle(0, 25, z, 40, -1) for z in planes]),
        ('HOLE', discs + [circle(0, 15, z) for z in planes]),
        ('BETWEEN', [circle(0, 25, z + 1.25) for z in planes]),
        ('LOBE', discs[:9]), ('LOBE', discs[12:])])


# ---- segmentations: frames of one grid, LPS; of a label map the values are the segments
def segmentation(path, kind, segments, frames, rows, columns, spacing, bits):
    plane = [elements((0x00209113, 'SQ', [elements((0x00200032, 'DS', '%g\\%g\\%g' % position))]),
                      *([] if kind == 'LABELMAP' else [(0x0062000A, 'SQ', [elements((0x0062000B, 'US', 1))])])) for position, _ in frames]
    shared = [elements((0x00209116, 'SQ', [elements((0x00200037, 'DS', '1\\0\\0\\0\\1\\0'))]),
                       (0x00289110, 'SQ', [elements((0x00180088, 'DS', '%g' % spacing[2]), (0x00280030, 'DS', '%g\\%g' % spacing[:2]))]))]
    values = [v for _, frame in frames for v in frame]
    if bits == 1:
        values += [0] * (-len(values) % 8)
        values = [sum(v << b for b, v in enumerate(values[i:i + 8])) for i in range(0, len(values), 8)]
    dicom(path, '1.2.840.10008.5.1.4.1.1.66.4', (0x00080060, 'CS', 'SEG'), (0x00280002, 'US', 1), (0x00280004, 'CS', 'MONOCHROME2'),
          (0x00280008, 'IS', str(len(frames))), (0x00280010, 'US', rows), (0x00280011, 'US', columns), (0x00280100, 'US', bits),
          (0x00280101, 'US', bits), (0x00280103, 'US', 0), (0x00620001, 'CS', kind),
          (0x00620002, 'SQ', [elements((0x00620004, 'US', n), (0x00620005, 'LO', name)) for n, name in segments]),
          (0x52009229, 'SQ', shared), (0x52009230, 'SQ', plane), (0x7FE00010, 'OB', bytes(values)))


# IBSI's mask, as text: 5 voxels of 2 mm a row, 4 rows a slice, 4 slices.
IBSI = ['11111 11111 11111 11111', '11111 11111 01111 11111', '11100 11111 11011 11111', '11100 11111 11111 11111']


def inside(rows, i, j):
    return 0 <= j < 4 and 0 <= i < 5 and rows[j][i] == '1'


def outlines(rows):
    """Along the edges of the voxels, in their units: every edge between in and out, chained to loops."""
    after = {}
    for j in range(4):
        for i in range(5):
            if not inside(rows, i, j):
                continue
            for (di, dj), a, b in (((0, -1), (0, 0), (1, 0)), ((1, 0), (1, 0), (1, 1)), ((0, 1), (1, 1), (0, 1)), ((-1, 0), (0, 1), (0, 0))):
                if not inside(rows, i + di, j + dj):
                    after[(i + a[0] - .5, j + a[1] - .5)] = (i + b[0] - .5, j + b[1] - .5)
    loops = []
    while after:
        loop = [next(iter(after))]
        while (follower := after.pop(loop[-1])) != loop[0]:
            loop.append(follower)
        loops.append(loop)
    return loops


def half_way(rows):
    """As marching squares draw: through the middles of those edges."""
    return [[((a[0] + b[0]) / 2, (a[1] + b[1]) / 2) for a, b in zip(loop, loop[1:] + loop[:1])] for loop in outlines(rows)]


def ibsi(folder):  # NIfTI's RAS axes are -x, -y, z
    slices = [s.split() for s in IBSI]
    for name, draw in (('ibsi_edges', outlines), ('ibsi_half_way', half_way)):
        structure_set(folder / f'{name}.dcm', [('ROI', [[(2 * x, 2 * y, 2 * z) for x, y in loop] for z, rows in enumerate(slices) for loop in draw(rows)])])
    frames = [((0, 0, 2 * z), [int(v) for row in rows for v in row]) for z, rows in enumerate(slices)]
    segmentation(folder / 'ibsi_seg.dcm', 'BINARY', [(1, 'ROI')], frames, 4, 5, (2, 2, 2), 1)
    block = [((0, 0, z), [int(1 <= i % 7 < 5 and 1 <= i // 7 < 4) for i in range(35)]) for z in range(4)]
    segmentation(folder / 'labelmap.dcm', 'LABELMAP', [(0, 'Background'), (1, 'block')], block, 5, 7, (1, 1, 1), 8)


if __name__ == '__main__':
    target = Path(sys.argv[1])
    for make in (images, names, contours, ibsi):
        make(target)
