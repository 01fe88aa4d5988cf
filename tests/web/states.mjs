// SPDX-License-Identifier: Apache-2.0
// States that the page's own solver sets: drawn as after a step, refused by name when they cannot be
// this organ's, and no memory grows.
// usage: node states.mjs PAGE [SETS]: of an organ with tetrahedra
import assert from "node:assert/strict";
import { Organ } from "../../apps/organweb/page/organ.js";
import { PositionBased } from "../consumer/web/solver.js";
import { parts_of_page } from "./page_file.mjs";

const [page, sets = "20000"] = process.argv.slice(2);
const { module, pack } = parts_of_page(page);
const organ = await Organ.open(module, pack);
const kWidth = 160, kHeight = 120;
const drawn = async (step) => (await organ.drawn(step, kWidth, kHeight), organ.pixels().slice());
await organ.loadAll();
const rest = await drawn(false);

// The mesh hangs together.
const mesh = organ.mesh(), count = mesh.vertices.length / 3;
assert.equal(mesh.vertexWeights.length, 4 * count);
for (let v = 0; v < count; ++v) {
  for (let k = 0; k < 3; ++k) {
    let at = 0;
    for (let c = 0; c < 4; ++c)
      at += mesh.vertexWeights[4 * v + c] * mesh.nodes[3 * mesh.tetrahedra[4 * mesh.vertexTetrahedron[v] + c] + k];
    assert.ok(Math.abs(at - mesh.vertices[3 * v + k]) < 1e-6);
  }
}
assert.ok(mesh.tissue.youngModulusKPa > 0 && mesh.tissue.density > 0);
assert.equal(mesh.nodeMass.length, mesh.nodes.length / 3);

// A solver of the page's own presses a ball in and lets go.
const solver = new PositionBased(mesh), radius = 12;
const top = mesh.vertices.slice(0, 3);
for (let v = 0; v < mesh.vertices.length; v += 3)
  if (mesh.vertices[v + 2] > top[2]) top.set(mesh.vertices.subarray(v, v + 3));
const ball = (depth) => [{ position: [top[0], top[1], top[2] + radius - depth], radius }];
for (let i = 0; i < 20; ++i) solver.step(ball(i / 2));
organ.setNodes(solver.x);
const pressed = await drawn(false);
assert.notDeepEqual(pressed, rest);
organ.placeTools(ball(10));
assert.notDeepEqual(await drawn(false), pressed);
organ.placeTools([]);
assert.deepEqual(await drawn(false), pressed);

// Forces for solvers without contact: none afar, inward where the ball presses.
organ.setVertices(mesh.vertices);
assert.ok(organ.contactForces(ball(-20)).every((f) => f === 0));
const forces = organ.contactForces(ball(4)), onNodes = organ.contactForces(ball(4), { nodes: true });
const sum = (f) => f.reduce((all, n, i) => (i % 3 === 2 ? all + n : all), 0);
assert.ok(sum(forces) < -0.01 && Math.abs(sum(forces) - sum(onNodes)) < 1e-9);

// What cannot be this organ's is refused and nothing lost; floats serve as well.
organ.setNodes(solver.x);
for (const [bad, words] of [
  [mesh.vertices.map((n, i) => (i === 7 ? NaN : n)), /not finite/],
  [mesh.vertices.map((n) => n / 1000), /in metres\?/], [mesh.vertices.slice(3), /for an organ of/],
  [new Float64Array(0), /0 vertices/], [mesh.vertices.map((n) => n + 9999), /another world/]])
  assert.throws(() => organ.setVertices(bad), words);
assert.throws(() => organ.setVertices([1, 2, 3]), TypeError);
assert.throws(() => organ.setNodes(mesh.nodes.slice(3)), /nodes for an organ of/);
assert.deepEqual(await drawn(false), pressed);
organ.setVertices(mesh.vertices);
assert.deepEqual(await drawn(false), rest);
organ.setVertices(new Float32Array(mesh.vertices));
await drawn(true);  // a step goes on from there
organ.reset();
assert.deepEqual(await drawn(false), rest);

const before = organ.memoryBytes, begin = performance.now();
for (let i = 0; i < Number(sets); ++i) organ.setVertices(mesh.vertices);
const microseconds = 1000 * (performance.now() - begin) / Number(sets);
assert.equal(organ.memoryBytes, before);
console.log(`states are drawn, ${sets} sets of ${count} vertices took ${microseconds.toFixed(1)} µs each and no memory`);
