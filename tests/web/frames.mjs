// SPDX-License-Identifier: Apache-2.0
// Plays an interaction in the module that a page holds and writes its frames as organplay does.
// usage: node frames.mjs PAGE SCRIPT FOLDER
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { Organ } from "../../apps/organweb/page/organ.js";
import { parts_of_page } from "./page_file.mjs";
import { png } from "./png.mjs";

const [page, script_file, folder] = process.argv.slice(2);
const { module, pack } = parts_of_page(page);
const organ = await Organ.open(module, pack);
const script = JSON.parse(readFileSync(script_file, "utf8"));
mkdirSync(folder, { recursive: true });
for (let frame = 0; frame < script.frames; ++frame) {
  await organ.play(script, frame);
  const name = `frame_${String(frame).padStart(4, "0")}.png`;
  writeFileSync(`${folder}/${name}`, png(organ.pixels(), ...script.size));
}
