// SPDX-License-Identifier: Apache-2.0
// MuJoCo moves an organ's picture, without a browser: a ball presses the flex of an exported model
// (`organbake export BUNDLE --format mjcf`), and the page's player (`--format web`) draws its nodes.
// Takes the npm package mujoco-js, looked for from the folder that this is started in.
// usage: node mujoco_flex.mjs PAGE MODEL.xml [PICTURE.ppm]
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";
import { Organ } from "../../../apps/organweb/page/organ.js";
import { parts_of_page } from "../../web/page_file.mjs";

const [page, file, picture] = process.argv.slice(2);
const found = createRequire(`${process.cwd()}/`).resolve("mujoco-js");
const mujoco = await (await import(pathToFileURL(found))).default();

const { module, pack } = parts_of_page(page);
const organ = await Organ.open(module, pack);
await organ.loadAll();
const mesh = organ.mesh(), top = mesh.nodes.slice(0, 3), radius = 12;
for (let n = 0; n < mesh.nodes.length; n += 3)
  if (mesh.nodes[n + 2] > top[2]) top.set(mesh.nodes.subarray(n, n + 3));
const ballAt = (depth) => [top[0], top[1], top[2] + radius - depth];

// The exported model with a ball in its world, which goes where it is told.
const ball = `<body name="ball" mocap="true" pos="${ballAt(-2).map((mm) => mm / 1000).join(" ")}">` +
             `<geom type="sphere" size="${radius / 1000}"/></body>\n  </worldbody>`;
mujoco.FS.mkdir("/model");
mujoco.FS.mount(mujoco.MEMFS, { root: "." }, "/model");
mujoco.FS.writeFile("/model/organ.xml", readFileSync(file, "utf8").replace("</worldbody>", ball));
const model = mujoco.MjModel.loadFromXML("/model/organ.xml"), data = new mujoco.MjData(model);
assert.equal(model.nflex, 1);
assert.equal(model.nflexvert, mesh.nodes.length / 3);
assert.equal(model.nflexelem, mesh.tetrahedra.length / 4);

const nodes = new Float64Array(mesh.nodes.length);
const takeNodes = () => data.flexvert_xpos.forEach((metres, i) => { nodes[i] = 1000 * metres; });
mujoco.mj_forward(model, data);
takeNodes();
const off = nodes.reduce((most, mm, i) => Math.max(most, Math.abs(mm - mesh.nodes[i])), 0);
assert.ok(off < 1e-6, `MuJoCo's nodes are ${off} mm from the bundle's`);

const [width, height] = [480, 360];
await organ.drawn(false, width, height);
const rest = organ.pixels().slice(), steps = Math.round(0.25 / model.opt.timestep);
let frames = 0, began = performance.now(), stepMs = 0, next = 0;
for (let step = 0; step < steps; ++step) {
  data.mocap_pos.set(ballAt(-2 + 25 * step / steps).map((mm) => mm / 1000));
  const begin = performance.now();
  mujoco.mj_step(model, data);
  stepMs += performance.now() - begin;
  if (data.time < next) continue;
  next += 1 / 60;
  takeNodes();
  organ.setNodes(nodes);
  organ.placeTools([{ position: ballAt(-2 + 25 * step / steps), radius }]);
  await organ.drawn(false, width, height);
  ++frames;
}
const moved = nodes.reduce((most, mm, i) => Math.max(most, Math.abs(mm - mesh.nodes[i])), 0);
assert.ok(moved > 2 && moved < 40, `the nodes moved ${moved} mm`);
assert.notDeepEqual(organ.pixels(), rest);
if (picture) {
  const rgba = organ.pixels(), rgb = Buffer.alloc(3 * width * height);
  for (let i = 0; i < width * height; ++i) for (let k = 0; k < 3; ++k) rgb[3 * i + k] = rgba[4 * i + k];
  writeFileSync(picture, Buffer.concat([Buffer.from(`P6\n${width} ${height}\n255\n`), rgb]));
}
console.log(`${steps} steps of MuJoCo, ${(stepMs / steps).toFixed(1)} ms each, moved the nodes ${moved.toFixed(1)} mm ` +
            `in ${frames} pictures; at rest they lay ${off.toExponential(1)} mm from the bundle's`);
