// SPDX-License-Identifier: Apache-2.0
// The blades of a page: where there are tetrahedra they cut, once all cameras are there; a reset
// makes the organ whole again, to the byte; elsewhere they are refused with a sentence.
// usage: node cut.mjs PAGE
import { Organ } from "../../apps/organweb/page/organ.js";
import { parts_of_page } from "./page_file.mjs";

const kWidth = 320, kHeight = 240, kMiddle = [160, 120];
const { module, pack } = parts_of_page(process.argv[2]);
const organ = await Organ.open(module, pack);
const draw = async (steps, before = () => {}) => {
  for (let step = 0; step < steps; ++step) before(step), await organ.drawn(true, kWidth, kHeight);
  return Buffer.from(organ.pixels());
};
const refused = (tool, sentence) => {
  try {
    organ.touch(...kMiddle, tool);
  } catch (error) {
    if (error.message.includes(sentence)) return;
    throw new Error(`${tool}: ${error.message}`);
  }
  throw new Error(`${tool} is not refused`);
};

await draw(1);
refused("saw", "there is no tool");
if (!organ.canCut) {
  for (const blade of ["cut", "snip"]) refused(blade, "mechanics.fem=false");
  console.log("no blades without tetrahedra");
  process.exit(0);
}
refused("cut", "all cameras");
await organ.loadAll();
const rest = await draw(1);

// Drawn across the picture and out at both sides, as deep as it goes: two pieces.
if (!organ.touch(...kMiddle, "cut")) throw new Error("there is no tissue in the middle");
organ.push(25);
await draw(16, (step) => organ.drag(160 - 12 * step, 120));
await draw(60, (step) => organ.drag(-20 + 8 * step, 120));
organ.letGo();
const cut = await draw(12);
if (organ.pieces < 2) throw new Error("the blade went through, and the organ is in one piece");
if (cut.equals(rest)) throw new Error("the cut does not show");
if (organ.recovered > 0) throw new Error("the tissue's state was lost");

organ.reset();
const whole = await draw(1);
if (organ.pieces !== 1) throw new Error("the organ at rest is in pieces");
if (!whole.equals(rest)) throw new Error("the organ at rest is not as it was");

// Scissors cut as they close.
if (!organ.touch(...kMiddle, "snip")) throw new Error("scissors meet no tissue");
await draw(10, (step) => organ.drag(160 + 4 * step, 120));
const open = await draw(1);
await draw(10, (step) => organ.drag(160 + 4 * (9 - step), 120));
organ.letGo();
const snipped = await draw(12);
if (snipped.equals(rest) || snipped.equals(open)) throw new Error("the scissors leave no trace");
if (!organ.touch(...kMiddle, "pierce")) throw new Error("a needle meets no tissue");
await draw(20, (step) => organ.push(0.5));
organ.letGo();
await draw(12);
if (organ.recovered > 0) throw new Error("the tissue's state was lost");
console.log(`cut, snipped, pierced: ${organ.pieces} piece, ${(organ.memoryBytes / 1e6).toFixed(0)} MB`);

// A poke that is undone leaves nothing; the other solver does what was done again.
organ.reset();
await draw(1);
const arrive = async () => {
  while (organ.seeking) await draw(1);
  await organ.drawn(false, kWidth, kHeight);  // a step more would go on from there
  return Buffer.from(organ.pixels());
};
if (organ.canUndo) throw new Error("a reset organ has something to undo");
const usual = organ.solver;
if (!organ.touch(...kMiddle, "poke")) throw new Error("a probe meets no tissue");
await draw(15, () => organ.push(0.5));
organ.letGo();
const poked = await draw(2);
organ.undo();
if (!(await arrive()).equals(rest)) throw new Error("what was undone leaves a trace");
organ.redo();
if (!(await arrive()).equals(poked)) throw new Error("what was done again looks otherwise");
organ.solver = 1 - usual;
const by_other = await arrive();
if (organ.solver === usual || by_other.equals(poked)) throw new Error("the solver is the same");
organ.scopeMm = 30;
await draw(1);
if (!(organ.scopeMm > 15 && organ.scopeMm < 45)) throw new Error(`the scope is at ${organ.scopeMm} mm`);
console.log("undone, done again, by both solvers");
