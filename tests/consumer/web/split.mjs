// SPDX-License-Identifier: Apache-2.0
// Takes the pack, the module, its shaders and its loader out of an exported page, for a page of your own.
// usage: node split.mjs PAGE FOLDER
import { copyFileSync, mkdirSync, writeFileSync } from "node:fs";
import { parts_of_page } from "../../web/page_file.mjs";

const [page, folder] = process.argv.slice(2);
const { module, shaders, pack } = parts_of_page(page);
mkdirSync(folder, { recursive: true });
writeFileSync(`${folder}/organ.wasm`, module);
writeFileSync(`${folder}/organ.pack`, pack);
writeFileSync(`${folder}/organ.glsl`, shaders);
for (const script of ["organ.js", "webgl.js"])
  copyFileSync(new URL(`../../../apps/organweb/page/${script}`, import.meta.url), `${folder}/${script}`);
copyFileSync(new URL("index.html", import.meta.url), `${folder}/index.html`);
