# SPDX-License-Identifier: Apache-2.0
"""An organ in a notebook: organplay.show(bundle)."""
import html
import pathlib
import struct
import zlib

from ._organplay import Player


def png(rgb):
    """An 8-bit RGB array (h, w, 3) as the bytes of a PNG."""
    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data
                + struct.pack(">I", zlib.crc32(kind + data)))
    height, width = rgb.shape[:2]
    rows = b"".join(b"\0" + row.tobytes() for row in rgb)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


class _Page:
    """A page of `organbake export --format web`, in a frame of the notebook."""

    def __init__(self, file, width, height):
        self._page = file.read_text(encoding="utf-8")
        self._size = width, height

    def _repr_html_(self):
        width, height = self._size
        return (f'<iframe srcdoc="{html.escape(self._page)}" width="{width}" height="{height}" '
                'style="border:0"></iframe>')


class _Still:
    """A picture of an organ."""

    def __init__(self, rgb):
        self.rgb = rgb

    def _repr_png_(self):
        return png(self.rgb)


def show(what, azimuth_rad=0.0, elevation_rad=0.0, *, width=640, height=480):
    """Shows an organ where a notebook shows its results.

    what: a page that `organbake export BUNDLE --format web` wrote (.html), which can be poked; or
    the folder of a bundle, or a Player as it lies now, of which it is a picture, from the orbit's
    angles. Raises OSError for what is missing, ValueError for what is damaged.
    """
    if isinstance(what, Player):
        player = what
    elif pathlib.Path(what).suffix == ".html":
        return _Page(pathlib.Path(what), width, height)
    else:
        player = Player(what)
    view = player.orbit(azimuth_rad, elevation_rad, width=width, height=height)
    return _Still(player.draw(view).rgb)
