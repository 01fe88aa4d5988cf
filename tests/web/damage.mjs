// SPDX-License-Identifier: Apache-2.0
// A page's pack, damaged in many ways: each is refused with a sentence, or plays; nothing hangs,
// nothing traps, memory stays bounded. usage: node damage.mjs PAGE [MUTATIONS]
import { gunzipSync, gzipSync } from "node:zlib";
import { Organ } from "../../apps/organweb/page/organ.js";
import { crc32_of } from "./crc32.mjs";
import { parts_of_page } from "./page_file.mjs";

const [page, count = "1000"] = process.argv.slice(2);
const parts = parts_of_page(page);
const module = await WebAssembly.compile(parts.module);
const kMostMemory = 400e6, kLongest_ms = 20000;

let state = 12345;  // a fixed stream of numbers
const below = (n) => {
  state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
  return Math.floor(state / 4294967296 * n);
};

function sections(pack) {
  const view = new DataView(pack.buffer, pack.byteOffset), parts = [];
  let at = 16 + 8 * view.getUint32(8, true);
  for (let p = 0; p < view.getUint32(8, true); ++p) {
    const packed = view.getUint32(12 + 8 * p, true);
    parts.push(new Uint8Array(gunzipSync(pack.subarray(at, at + packed))));
    at += packed;
  }
  return parts;
}
// A pack whose checksums are right, whatever its parts hold.
function sealed(sections) {
  const streams = sections.map((bytes) => gzipSync(bytes, { level: 1 }));
  const head = Buffer.alloc(16 + 8 * sections.length);
  head.write("ORGANPK1");
  head.writeUInt32LE(sections.length, 8);
  streams.forEach((stream, p) => {
    head.writeUInt32LE(stream.length, 12 + 8 * p);
    head.writeUInt32LE(sections[p].length, 16 + 8 * p);
  });
  head.writeUInt32LE(crc32_of(head.subarray(0, head.length - 4)), head.length - 4);
  return new Uint8Array(Buffer.concat([head, ...streams]));
}

// What becomes of a pack: "plays", or the sentence it is refused with.
async function outcome(pack) {
  const begin = Date.now();
  let organ = null, result = "plays";
  try {
    organ = await Organ.open(module, pack);
    for (let camera = 0; camera < organ.cameras; ++camera) await organ.loadNext();
    await organ.drawn(true, 160, 120);
    organ.touch(80, 60);
    for (let step = 0; step < 5; ++step) {
      organ.drag(80 + 3 * step, 60);
      await organ.drawn(true, 160, 120);
    }
    if (!Number.isFinite(organ.forceN)) throw new TypeError("the force is no number");
  } catch (error) {
    if (error.constructor !== Error || error.message.length < 10) throw error;  // a trap, or no sentence
    result = error.message;
  }
  if (Date.now() - begin > kLongest_ms) throw new Error("it took too long");
  if (organ && organ.memoryBytes > kMostMemory) throw new Error(`it took ${organ.memoryBytes} bytes`);
  return result;
}

function mutated(bytes) {
  const copy = bytes.slice();
  const kind = below(4);
  if (kind === 0) return copy.subarray(0, below(copy.length));            // cut short
  const times = kind === 1 ? 1 : 1 + below(30);
  for (let i = 0; i < times; ++i) copy[below(copy.length)] ^= 1 << below(8);
  if (kind === 3) {                                                       // a huge count
    const at = below(Math.min(copy.length, 400) - 4);
    copy.set([255, 255, 255, below(2) ? 255 : 127], at);
  }
  return copy;
}

const whole = sections(parts.pack);
if (await outcome(parts.pack) !== "plays") throw new Error("the pack itself does not play");
if (await outcome(sealed(whole)) !== "plays") throw new Error("the pack does not play when sealed anew");
const tally = { plays: 0, refused: 0 }, sentences = new Map();
const note = (result) => {
  ++tally[result === "plays" ? "plays" : "refused"];
  const kind = result.replace(/[0-9.e+-]+/g, "#").slice(0, 90);
  sentences.set(kind, (sentences.get(kind) ?? 0) + 1);
};
for (const pack of [new Uint8Array(0), new Uint8Array(8), parts.pack.subarray(0, 11), parts.pack.subarray(0, 200),
                    new Uint8Array(300).fill(255), new Uint8Array([...parts.pack, 0])]) {
  const result = await outcome(pack);
  if (result === "plays") throw new Error("a pack that is none plays");
  note(result);
}
for (let m = 0; m < Number(count); ++m) {
  if (m % 4 === 0) {  // as it lies in the page: the checksums must tell
    const pack = mutated(parts.pack);
    if (Buffer.compare(pack, parts.pack) === 0) continue;
    const result = await outcome(pack);
    if (result === "plays") throw new Error(`mutation ${m} was not noticed`);
    note(result);
  } else {  // with checksums made anew: the module must
    const changed = whole.slice(), p = below(3) === 0 ? 0 : below(whole.length);
    changed[p] = mutated(changed[p]);
    note(await outcome(sealed(changed)));
  }
}
console.log(`${tally.refused} refused, ${tally.plays} play, in ${sentences.size} ways`);
if (process.env.VERBOSE) for (const [kind, times] of sentences) console.log(String(times).padStart(5), kind);
