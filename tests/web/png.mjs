// SPDX-License-Identifier: Apache-2.0
// Pictures as PNG files, for organplay to compare with its own.
import { crc32_of } from "./crc32.mjs";
import { deflateSync } from "node:zlib";

function chunk(type, data) {
  const body = Buffer.concat([Buffer.from(type, "latin1"), data]);
  const length = Buffer.alloc(4), crc = Buffer.alloc(4);
  length.writeUInt32BE(data.length);
  crc.writeUInt32BE(crc32_of(body));
  return Buffer.concat([length, body, crc]);
}

// rgba: bytes of width × height pixels, top row first.
export function png(rgba, width, height) {
  const rows = Buffer.alloc(height * (1 + 3 * width));
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      for (let k = 0; k < 3; ++k)
        rows[y * (1 + 3 * width) + 1 + 3 * x + k] = rgba[4 * (y * width + x) + k];
    }
  }
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(height, 4);
  head.set([8, 2, 0, 0, 0], 8);
  return Buffer.concat([Buffer.from([0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10]), chunk("IHDR", head),
                        chunk("IDAT", deflateSync(rows, { level: 1 })), chunk("IEND", Buffer.alloc(0))]);
}
