// SPDX-License-Identifier: Apache-2.0
// Takes the pack, the module and its loader out of an exported page, for a page of your own.
// usage: node split.mjs PAGE FOLDER
import { copyFileSync, mkdirSync, writeFileSync } from "node:fs";
import { parts_of_page } from "../../web/page_file.mjs";

const [page, folder] = process.argv.slice(2);
const { module, pack } = parts_of_page(page);
mkdirSync(folder, { recursive: true });
writeFileSync(`${folder}/organ.wasm`, module);
writeFileSync(`${folder}/organ.pack`, pack);
copyFileSync(new URL("../../../apps/organweb/page/organ.js", import.meta.url), `${folder}/organ.js`);
copyFileSync(new URL("index.html", import.meta.url), `${folder}/index.html`);
