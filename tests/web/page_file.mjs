// SPDX-License-Identifier: Apache-2.0
// What a page of `organbake export --format web` holds: its module, its shaders and its pack.
import { readFileSync } from "node:fs";
import { gunzipSync } from "node:zlib";

export function parts_of_page(file) {
  const page = readFileSync(file, "utf8");
  const held = (id) => {
    const found = page.match(new RegExp(`<script type="text/plain" id="${id}">([^<]*)</script>`));
    if (!found) throw new Error(`${file} holds no ${id}`);
    return new Uint8Array(Buffer.from(found[1], "base64"));
  };
  const unpacked = (id) => new Uint8Array(gunzipSync(held(id)));
  return { module: unpacked("module"), shaders: unpacked("shaders"), pack: held("pack") };
}
