// SPDX-License-Identifier: Apache-2.0
// A page in Chromium, from file://: it shows the organ, real pointers, fingers and keys poke and turn
// it, a damaged pack is a sentence, nothing is asked of any server and nothing complains.
// usage: node page_in_browser.mjs PAGE [FOLDER for screenshots]; exit code 77 without a browser
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { Browser, find_chromium, sleep } from "./browser.mjs";

if (!find_chromium()) {
  console.log("SKIPPED: there is no Chromium here (Debian: chromium); the page was not opened");
  process.exit(77);
}
const [page, kept] = process.argv.slice(2);
const own = mkdtempSync(join(tmpdir(), "organ-page-"));
let failures = 0;
const expect = (holds, what) => {
  if (!holds) console.log(`FAILED: ${what}`), ++failures;
};

const browser = await Browser.start(900, 700);
const keep = (name) => browser.keep(kept, name);
const kShown = 'document.getElementById("loading")?.hidden && document.getElementById("error")?.hidden';
// Two pictures of 24 × 18 fields of the canvas differ: how many fields, and where their middle is.
const remember = (name) => browser.value(`(() => {
  const small = Object.assign(document.createElement("canvas"), { width: 24, height: 18 });
  const context = small.getContext("2d");
  context.drawImage(document.getElementById("canvas"), 0, 0, 24, 18);
  (window.kept ??= {})["${name}"] = context.getImageData(0, 0, 24, 18).data;
})()`);
const changed = (a, b) => browser.value(`(() => {
  let count = 0, x = 0, y = 0, colors = new Set();
  for (let i = 0; i < 24 * 18; ++i) {
    const [p, q] = ["${a}", "${b}"].map((name) => window.kept[name].slice(4 * i, 4 * i + 3));
    colors.add(q.join());
    if (Math.max(...p.map((v, k) => Math.abs(v - q[k]))) < 12) continue;
    ++count, x += i % 24 + 0.5, y += Math.floor(i / 24) + 0.5;
  }
  return { count, x: x / count / 24, y: y / count / 18, colors: colors.size };
})()`);
const settle = async () => {
  await sleep(250);  // what was asked for is being drawn
  await browser.until("organ.unchanged", 20).catch(() => expect(false, "the organ comes to rest"));
  await sleep(100);
};

await browser.open(resolve(page), "#pixels=150000");
await browser.until(kShown);
const box = await browser.value(`(({ left, top, width, height }) => ({ left, top, width, height }))(
  document.getElementById("canvas").getBoundingClientRect())`);
const at = (x, y) => [box.left + x * box.width, box.top + y * box.height];
await settle();
await remember("rest");
expect((await changed("rest", "rest")).colors > 40, "the first picture shows an organ, not one colour");
await keep("rest");

// Poke where the organ is: the pixels there change, those of the ground do not.
await browser.mouse("mousePressed", ...at(0.5, 0.5));
for (let i = 1; i <= 8; ++i) await browser.mouse("mouseMoved", ...at(0.5 + 0.005 * i, 0.5)), await sleep(30);
await browser.until("organ.depthMm > 1 && organ.forceN > 0", 20).catch(() => expect(false, "the poke presses"));
await settle();
await remember("poked");
await keep("poked");
const poke = await changed("rest", "poked");
expect(poke.count > 3, `the poke changes the picture (${poke.count} fields)`);
expect(poke.count < 24 * 18 / 2, `and not all of it (${poke.count} fields)`);
expect(Math.hypot(poke.x - 0.5, poke.y - 0.55) < 0.3, `near the pointer (${poke.x}, ${poke.y})`);
await browser.mouse("mouseReleased", ...at(0.54, 0.5));
await browser.value('document.getElementById("reset").click()');
await settle();
await remember("again");
await keep("again");
const back = await changed("rest", "again");
expect(back.count === 0, `reset gives the first picture back (${back.count} fields, ${back.x}, ${back.y})`);

// Beside the organ the pointer turns it.
await browser.mouse("mousePressed", ...at(0.02, 0.04));
for (let i = 1; i <= 8; ++i) await browser.mouse("mouseMoved", ...at(0.02 + 0.05 * i, 0.04)), await sleep(30);
await browser.mouse("mouseReleased", ...at(0.42, 0.04));
await settle();
await remember("turned");
expect((await changed("again", "turned")).count > 20, "a drag beside the organ turns it");
await keep("turned");
await browser.value('document.getElementById("front").click()');
await settle();
await remember("front");
expect((await changed("again", "front")).count === 0, "the first view comes back");

// Keys: turn, then poke at the cross.
await browser.value('document.getElementById("canvas").focus()');
await browser.key("keyDown", "ArrowLeft");
await browser.key("keyUp", "ArrowLeft");
await settle();
await remember("key");
expect((await changed("front", "key")).count > 0, "an arrow key turns the organ");
await browser.key("keyDown", "v");
await browser.key("keyUp", "v");
for (let i = 0; i < 6; ++i) await browser.key("keyDown", " "), await sleep(40);
await settle();
expect(await browser.value("organ.depthMm > 1"), "space presses the tool in");
await browser.key("keyUp", " ");
expect((await browser.value('document.getElementById("status").textContent')).includes("Let go"),
       "what happened is said to screen readers");
await browser.key("keyDown", "r");
await settle();

// A blade, where the organ has tetrahedra: drawn across the picture it leaves a cut, which a reset
// heals.
if (await browser.value("organ.canCut")) {
  await browser.value('document.getElementById("front").click()');
  expect(await browser.value('!document.getElementById("cut_width_mm")'), "no width without a blade");
  await browser.value(`document.querySelector('[data-mode="cut"]').click()`);
  expect(await browser.value('!!document.getElementById("cut_width_mm")'), "a cut has a width");
  await settle();
  await remember("whole");
  await browser.value(`((width) => {
    width.value = "3";
    width.dispatchEvent(new Event("input"));
  })(document.getElementById("cut_width_mm"))`);
  expect(await browser.value('organ.toolNumbers("cut")[0].value') === 3, "the width is the next cut's");
  await browser.mouse("mousePressed", ...at(0.4, 0.5));
  for (let i = 1; i <= 20; ++i) await browser.mouse("mouseMoved", ...at(0.4 + 0.01 * i, 0.5)), await sleep(40);
  await browser.mouse("mouseReleased", ...at(0.6, 0.5));
  await sleep(1500);
  await settle();
  await remember("cut");
  await keep("cut");
  const cut = await changed("whole", "cut");
  expect(cut.count > 3 && Math.hypot(cut.x - 0.5, cut.y - 0.5) < 0.15,
         `the cut shows where the blade went (${cut.count} fields at ${cut.x}, ${cut.y})`);
  await browser.value('document.getElementById("reset").click()');
  await settle();
  await remember("healed");
  expect((await changed("whole", "healed")).count === 0, "reset makes the organ whole");
  await browser.value(`document.querySelector('[data-mode="poke"]').click()`);
}

// A finger pokes, two zoom.
const finger = (x, y, id) => ({ x: at(x, y)[0], y: at(x, y)[1], id });
await browser.send("Emulation.setTouchEmulationEnabled", { enabled: true });
await browser.touch("touchStart", [finger(0.5, 0.5, 1)]);
for (let i = 1; i <= 6; ++i) await browser.touch("touchMove", [finger(0.5, 0.5 + 0.008 * i, 1)]), await sleep(30);
await browser.until("organ.depthMm > 1", 20).catch(() => expect(false, "a finger pokes"));
await browser.touch("touchEnd", []);
await browser.key("keyDown", "r");
await settle();
await remember("before_zoom");
await browser.touch("touchStart", [finger(0.4, 0.5, 1), finger(0.6, 0.5, 2)]);
for (let i = 1; i <= 6; ++i) {
  await browser.touch("touchMove", [finger(0.4 - 0.02 * i, 0.5, 1), finger(0.6 + 0.02 * i, 0.5, 2)]);
  await sleep(30);
}
await browser.touch("touchEnd", []);
await settle();
await remember("zoomed");
await keep("zoomed");
expect((await changed("before_zoom", "zoomed")).count > 20, "two fingers zoom");

const asked = browser.requests.filter((url) => !url.startsWith("file://") && !url.startsWith("data:"));
expect(browser.requests.length >= 1 && asked.length === 0, `nothing is asked of a server: ${asked}`);
expect(browser.complaints.length === 0, `nothing complains: ${browser.complaints}`);

// Damaged in the middle of the pack: a sentence, and no more.
const text = readFileSync(page, "utf8"), start = text.indexOf('id="pack">') + 10;
const middle = start + Math.floor((text.indexOf("<", start) - start) / 2);
const other = text[middle] === "A" ? "B" : "A";
writeFileSync(join(own, "damaged.html"), text.slice(0, middle) + other + text.slice(middle + 1));
await browser.open(join(own, "damaged.html"));
await browser.until('document.getElementById("error")?.hidden === false', 60)
  .catch(() => expect(false, "a damaged page says so"));
const said = await browser.value('document.getElementById("error").textContent');
expect(/^This organ cannot be shown: .{10,}\.$/.test(said), `in a sentence: ${said}`);
await keep("damaged");
await browser.close();

// Under a tool that is held still the picture becomes as fine as the screen, as it does without.
const large = await Browser.start(1400, 1100);
await large.open(resolve(page));
await large.until(kShown);
const middle_px = await large.value(`(({ left, top, width, height }) => [left + width / 2, top + height / 2])(
  document.getElementById("canvas").getBoundingClientRect())`);
await large.mouse("mousePressed", ...middle_px);
for (let i = 1; i <= 8; ++i) await large.mouse("mouseMoved", middle_px[0] + 5 * i, middle_px[1]), await sleep(30);
await large.until("organ.forceN > 0 && document.getElementById('canvas').width < innerWidth", 20)
  .catch(() => expect(false, "a large window's organ is poked in fewer pixels than it has"));
await large.until("organ.forceN > 0 && document.getElementById('canvas').width === innerWidth", 20)
  .catch(() => expect(false, "a tool held still lets the picture become fine"));
await large.close();

rmSync(own, { recursive: true, force: true });
console.log(failures === 0 ? "the page passed in Chromium" : `${failures} expectation(s) failed`);
process.exit(failures === 0 ? 0 : 1);
