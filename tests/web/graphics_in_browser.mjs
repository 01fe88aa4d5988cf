// SPDX-License-Identifier: Apache-2.0
// A page whose pictures graphics hardware draws, in Chromium with software WebGL: they are the
// processor's to 40 dB, at rest, poked and cut; what is wrong or lost leaves the organ to the processor.
// usage: node graphics_in_browser.mjs PAGE [FOLDER for screenshots]; exit code 77 without WebGL 2
import { resolve } from "node:path";
import { WebGl } from "../../apps/organweb/page/webgl.js";
import { Browser, find_chromium, sleep } from "./browser.mjs";
import { parts_of_page } from "./page_file.mjs";

const left_out = (why) => {
  console.log(`SKIPPED: ${why}; no page was drawn by WebGL`);
  process.exit(77);
};
if (!find_chromium()) left_out("there is no Chromium here (Debian: chromium)");
const kLeastDb = 40;
const [page, kept] = process.argv.slice(2);
let failures = 0;
const expect = (holds, what) => {
  if (!holds) console.log(`FAILED: ${what}`), ++failures;
};
// Every call of the module's has somebody to answer it.
const { calls } = new WebGl("");
const wanted = WebAssembly.Module.imports(new WebAssembly.Module(parts_of_page(page).module));
for (const { name } of wanted)
  if (name.startsWith("gl")) expect(name in calls, `webgl.js knows ${name}`);
for (const name in calls)
  expect(wanted.some((one) => one.name === name), `the module calls ${name}`);

const browser = await Browser.start(900, 700);
const keep = (name) => browser.keep(kept, name);
const told = () => browser.value('document.getElementById("painted").textContent');
const shown = async (hash) => {
  await browser.send("Page.navigate", { url: "about:blank" });  // another hash alone loads nothing
  await browser.open(resolve(page), hash);
  await browser.until("window.organ");
  await browser.until('document.getElementById("painted").textContent !== ""');
};
const settle = async () => {
  await sleep(250);  // what was asked for is being drawn
  await browser.until("organ.unchanged", 180).catch(() => expect(false, "the organ comes to rest"));
  await sleep(100);
};
const choose = async (what, value) => {
  await browser.value(`((choice) => {
    choice.value = "${value}";
    choice.dispatchEvent(new Event("change"));
  })(document.getElementById("${what}"))`);
  await settle();
};
const paint_by = (who) => choose("painter", who);
const remember = (name) => browser.value(`(() => {
  const canvas = document.getElementById("canvas");
  (window.kept ??= {})["${name}"] = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
})()`);
const agreement = (a, b) => browser.value(`(([a, b]) => {
  let sum = 0;
  for (let i = 0; i < a.length; ++i) sum += (a[i] - b[i]) ** 2;
  return 10 * Math.log10(255 ** 2 * 0.75 * a.length / Math.max(sum, 1));  // alpha does not count
})([window.kept["${a}"], window.kept["${b}"]])`);
// The picture by graphics hardware, then by the processor, then by the first again.
const compare = async (name) => {
  await settle();
  expect(await browser.value("organ.graphics"), `${name}: graphics hardware draws: ${await told()}`);
  await remember("gpu");
  await keep(`${name}_gpu`);
  await paint_by("cpu");
  expect(!await browser.value("organ.graphics"), `${name}: then the processor`);
  await remember("cpu");
  await keep(`${name}_cpu`);
  const db = await agreement("gpu", "cpu");
  console.log(`${name}: ${db.toFixed(2)} dB`);
  expect(db >= kLeastDb, `${name}: both draw the same (${db.toFixed(2)} dB)`);
  await paint_by("gpu");
  return db;
};
const box_of = () => browser.value(`(({ left, top, width, height }) => [left, top, width, height])(
  document.getElementById("canvas").getBoundingClientRect())`);

// What a page makes of contexts, for the test to lose them, and a driver that draws wrong.
await browser.send("Page.addScriptToEvaluateOnNewDocument", { source: `
  window.contexts = [];
  const plain = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
    const made = plain.call(this, kind, ...more);
    if (kind === "webgl2" && made) window.contexts.push(made);
    return made;
  };
  if (location.hash.includes("wrong")) {
    const read = WebGL2RenderingContext.prototype.readPixels;
    WebGL2RenderingContext.prototype.readPixels = function (x, y, width, height, format, type, to) {
      read.call(this, x, y, width, height, format, type, to);
      for (let i = 0; i < 4 * width * height; i += 4) to[i] = 255 - to[i];
    };
  }` });

await shown("#draw=gpu&pixels=80000");
if ((await told()).includes("offers no WebGL 2.")) {
  await browser.close();
  left_out("this Chromium has no software WebGL 2");
}
const [left, top, width, height] = await box_of();
const at = (x, y) => [left + x * width, top + y * height];
for (const light of await browser.value('[...document.getElementById("light").options].map((o) => o.value)')) {
  await choose("light", light);
  await compare(`rest, light ${light}`);
}
const before = await browser.value("organ.scopeMm");
expect(before > 1, `the scope's distance is told (${before} mm)`);

await browser.mouse("mousePressed", ...at(0.5, 0.5));
for (let i = 1; i <= 8; ++i) await browser.mouse("mouseMoved", ...at(0.5 + 0.005 * i, 0.5)), await sleep(60);
await browser.until("organ.depthMm > 1 && organ.forceN > 0", 60).catch(() => expect(false, "the poke presses"));
await compare("poked");
await browser.mouse("mouseReleased", ...at(0.54, 0.5));
await browser.value('document.getElementById("reset").click()');
await settle();

if (await browser.value("organ.canCut")) {
  await browser.value(`document.querySelector('[data-mode="cut"]').click()`);
  await browser.mouse("mousePressed", ...at(0.4, 0.5));
  for (let i = 1; i <= 20; ++i) await browser.mouse("mouseMoved", ...at(0.4 + 0.01 * i, 0.5)), await sleep(60);
  await browser.mouse("mouseReleased", ...at(0.6, 0.5));
  await sleep(2000);
  await compare("cut");
}

// A context that is lost: the same picture, the cut in it, by the processor, and later again.
await settle();
await remember("before");
await browser.value('contexts.at(-1).getExtension("WEBGL_lose_context").loseContext()');
await browser.until("!organ.graphics", 20).catch(() => expect(false, "a lost context is noticed"));
await settle();
expect((await told()).includes("context was lost"), `and said: ${await told()}`);
await remember("lost");
expect(await agreement("before", "lost") >= kLeastDb, "the organ is as it was");
await paint_by("gpu");
expect(await browser.value("organ.graphics"), `a new context takes its place: ${await told()}`);
const noise = /GPU stall|software fallback|CONTEXT_LOST|willReadFrequently/;
const complaints = browser.complaints.filter((text) => !noise.test(text));
expect(complaints.length === 0, `nothing complains: ${complaints}`);

await shown("#pixels=60000");
await settle();
expect(/no WebGL 2 by graphics|is software, not graphics/.test(await told()) && !await browser.value("organ.graphics"),
       `by itself a page takes no software for hardware: ${await told()}`);
await shown("#draw=gpu&pixels=60000&wrong");
await settle();
expect((await told()).includes("is not the processor's") && !await browser.value("organ.graphics"),
       `a driver that draws wrong is found out: ${await told()}`);
await browser.close();
console.log(failures === 0 ? "graphics hardware drew the page" : `${failures} expectation(s) failed`);
process.exit(failures === 0 ? 0 : 1);
