// SPDX-License-Identifier: Apache-2.0
// Poked, pulled and turned for so many steps: no number that is none, no growth.
// usage: node poke_long.mjs PAGE [STEPS]
import { Organ } from "../../apps/organweb/page/organ.js";
import { parts_of_page } from "./page_file.mjs";

const [page, steps = "3600"] = process.argv.slice(2);
const { module, pack } = parts_of_page(page);
const organ = await Organ.open(module, pack);
const kWidth = 160, kHeight = 120;
await organ.loadAll();
await organ.drawn(false, kWidth, kHeight);
let state = 7;
const share = () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 4294967296;
let held = 0, touched = 0, warm = 0, late = 0;
for (let step = 0; step < Number(steps); ++step) {
  if (held === 0) {
    organ.letGo();
    held = Math.round(20 + 60 * share());
    if (organ.touch(kWidth * (0.2 + 0.6 * share()), kHeight * (0.2 + 0.6 * share()), share() < 0.4 ? "grab" : "poke")) ++touched;
  }
  organ.drag(kWidth * share(), kHeight * share());
  organ.turn(6 * share() - 3, 2 * share() - 1);
  if (!organ.draw(true, kWidth, kHeight)) throw new Error("a camera was not there");
  if (!Number.isFinite(organ.forceN) || !Number.isFinite(organ.depthMm)) throw new Error(`no number at step ${step}`);
  if (organ.recovered > 0) throw new Error(`the tissue's state was lost at step ${step}`);
  --held;
  if (step === Math.floor(Number(steps) / 3)) warm = organ.memoryBytes;
  if (step % 36000 === 35999) console.log(`${step + 1} steps, ${touched} touches, ${(organ.memoryBytes / 1e6).toFixed(1)} MB`);
}
late = organ.memoryBytes;
if (touched < Number(steps) / 200) throw new Error(`only ${touched} touches met tissue`);
console.log(`${steps} steps, ${touched} touches, ${(late / 1e6).toFixed(1)} MB, ${((late - warm) / 1e6).toFixed(1)} more than after a third`);
if (late - warm > 0.1 * warm) throw new Error("memory grows");
