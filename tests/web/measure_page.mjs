// SPDX-License-Identifier: Apache-2.0
// How long a page takes in Chromium: from opening to the first picture, and a picture of 960 × 720
// while it is turned and poked. usage: node measure_page.mjs PAGE [TIMES]
import { resolve } from "node:path";
import { Browser } from "./browser.mjs";

const [page, times = "5"] = process.argv.slice(2);
const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];
const opened = [], drawn = {};
for (let t = 0; t < Number(times); ++t) {
  const browser = await Browser.start(960, 900);
  await browser.open(resolve(page));
  await browser.until("window.organ !== undefined");
  opened.push(await browser.value('performance.getEntriesByName("organ shown")[0].startTime'));
  const pictures = await browser.value(`(async () => {
    const times = {};
    while (await organ.loadNext());
    for (const light of organ.lights > 1 ? [0, 1, 2] : [0]) {
      organ.light = light;
      for (const poked of [false, true]) {
        organ.faceFront(), organ.reset(), organ.draw(false, 960, 720);
        if (poked) organ.touch(480, 360);
        const list = times["light " + light + (poked ? ", orbit and poke" : ", orbit")] = [];
        for (let i = 0; i < 240; ++i) {
          organ.turn(3, 0.5 * Math.sin(i / 9));
          if (poked) organ.drag(480 + 60 * Math.sin(i / 20), 360);
          const start = performance.now();
          organ.draw(true, 960, 720);
          if (i >= 60) list.push(performance.now() - start);
          if (i % 20 === 0) await new Promise((wake) => setTimeout(wake));
        }
        organ.letGo();
      }
    }
    return times;
  })()`);
  for (const [name, list] of Object.entries(pictures)) (drawn[name] ??= []).push(median(list));
  await browser.close();
}
console.log(`first picture after ${median(opened).toFixed(0)} ms (${opened.map((ms) => ms.toFixed(0)).join(" ")})`);
for (const [name, list] of Object.entries(drawn))
  console.log(`${name}: ${median(list).toFixed(1)} ms (${list.map((ms) => ms.toFixed(1)).join(" ")})`);
