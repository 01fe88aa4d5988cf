# SPDX-License-Identifier: GPL-3.0-or-later
import pathlib
import struct
import zlib


def png(path_or_bytes):
    """Width, height, channels, bits and rows of samples."""
    data = path_or_bytes if isinstance(path_or_bytes, bytes) else pathlib.Path(path_or_bytes).read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + length]
        assert struct.unpack_from(">I", data, at + 8 + length)[0] == zlib.crc32(kind + body)
        if kind == b"IHDR":
            width, height, bits, color, _, _, interlace = struct.unpack(">IIBBBBB", body)
            assert interlace == 0
        if kind == b"IDAT":
            packed += body
        at += 12 + length
    channels = {0: 1, 2: 3, 6: 4}[color]
    step = channels * bits // 8
    raw, rows, last = zlib.decompress(packed), [], bytes(width * step)
    for y in range(height):
        filter_type, line = raw[y * (width * step + 1)], bytearray(raw[y * (width * step + 1) + 1:(y + 1) * (width * step + 1)])
        for i in range(len(line)):
            a = line[i - step] if i >= step else 0
            b, c = last[i], last[i - step] if i >= step else 0
            if filter_type == 1:
                line[i] = line[i] + a & 255
            elif filter_type == 2:
                line[i] = line[i] + b & 255
            elif filter_type == 3:
                line[i] = line[i] + (a + b) // 2 & 255
            elif filter_type == 4:
                p = a + b - c
                line[i] = line[i] + min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2] & 255
        last = bytes(line)
        rows.append(struct.unpack(f">{width * channels}H", last) if bits == 16 else last)
    return width, height, channels, bits, rows
