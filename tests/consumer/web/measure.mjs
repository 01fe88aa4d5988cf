// SPDX-License-Identifier: Apache-2.0
// The same module without a browser: press the middle of the picture in and say what it takes.
// usage: node measure.mjs PAGE
import { Organ } from "../../../apps/organweb/page/organ.js";
import { parts_of_page } from "../../web/page_file.mjs";

const { module, pack } = parts_of_page(process.argv[2]);
const organ = await Organ.open(module, pack);
await organ.drawn(false, 320, 240);
if (!organ.touch(160, 120)) throw new Error("there is no tissue in the middle");
organ.push(6);  // mm
for (let step = 0; step < 60; ++step) await organ.drawn(true, 320, 240);
console.log(`${organ.depthMm.toFixed(1)} mm deep: ${organ.forceN.toFixed(2)} newtons`);
