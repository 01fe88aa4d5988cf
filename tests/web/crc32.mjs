// SPDX-License-Identifier: Apache-2.0
const table = Uint32Array.from({ length: 256 }, (_, n) => {
  for (let bit = 0; bit < 8; ++bit) n = n & 1 ? n >>> 1 ^ 0xEDB88320 : n >>> 1;
  return n >>> 0;
});
export function crc32_of(bytes) {
  let crc = ~0;
  for (const byte of bytes) crc = crc >>> 8 ^ table[(crc ^ byte) & 255];
  return ~crc >>> 0;
}
