// SPDX-License-Identifier: Apache-2.0
// Opens pages in Chromium and keeps pictures of them, to be looked at.
// usage: node look.mjs PAGE FOLDER
import { mkdirSync, writeFileSync } from "node:fs";
import { resolve } from "node:path";
import { Browser } from "./browser.mjs";

const [page, folder] = process.argv.slice(2);
mkdirSync(folder, { recursive: true });
const keep = async (browser, name) => writeFileSync(`${folder}/${name}.png`, await browser.screenshot());
const kShown = 'performance.getEntriesByName("organ shown").length > 0 && window.organ !== undefined';

for (const [name, width, height, scheme] of [["desk", 1100, 800, "dark"], ["light", 1100, 800, "light"], ["phone", 390, 780, "light"]]) {
  const browser = await Browser.start(width, height);
  await browser.send("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: scheme }] });
  await browser.open(resolve(page));
  await browser.until(kShown);
  await browser.until("document.getElementById('loading').hidden");
  await new Promise((wake) => setTimeout(wake, 1500));
  await keep(browser, `${name}_rest`);
  const box = await browser.value("(() => { const b = document.getElementById('canvas').getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; })()");
  await browser.mouse("mousePressed", ...box);
  for (let i = 1; i <= 12; ++i) {
    await browser.mouse("mouseMoved", box[0] + 4 * i, box[1] + 2 * i);
    await new Promise((wake) => setTimeout(wake, 40));
  }
  await new Promise((wake) => setTimeout(wake, 1500));
  await keep(browser, `${name}_poked`);
  await browser.mouse("mouseReleased", box[0] + 48, box[1] + 24);
  console.log(name, await browser.value("document.getElementById('figures').textContent"), browser.requests.map((u) => u.slice(0, 60)), browser.complaints);
  await browser.close();
}
