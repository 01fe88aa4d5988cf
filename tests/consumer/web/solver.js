// SPDX-License-Identifier: Apache-2.0
// A solver of one's own in fifty lines: position-based dynamics (Müller et al. 2007) on the
// tetrahedra that organ.mesh() tells. Edges keep their lengths, one after the other; a ball pushes
// nodes out of itself. organ.setNodes(solver.x) then shows what came of it.

export class PositionBased {
  constructor(mesh, { timeStep = 1 / 60, iterations = 10 } = {}) {
    const { nodes, tetrahedra } = mesh, edges = new Map();
    for (let t = 0; t < tetrahedra.length; t += 4) {
      for (const [i, j] of [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]) {
        const a = Math.min(tetrahedra[t + i], tetrahedra[t + j]);
        const b = Math.max(tetrahedra[t + i], tetrahedra[t + j]);
        edges.set(a * nodes.length + b, [a, b, this.#length(nodes, a, b)]);
      }
    }
    this.edges = [...edges.values()];
    this.inverseMass = mesh.nodeMass.map((kg) => 1 / kg);
    for (const anchor of mesh.nodeAnchors) this.inverseMass[anchor] = 0;
    this.x = nodes.slice();
    this.velocity = new Float64Array(nodes.length);
    this.before = nodes.slice();
    Object.assign(this, { timeStep, iterations });
  }

  #length(x, a, b) {
    return Math.hypot(x[3 * b] - x[3 * a], x[3 * b + 1] - x[3 * a + 1], x[3 * b + 2] - x[3 * a + 2]);
  }

  #keepLengths() {
    const { x, inverseMass } = this;
    for (const [a, b, rest] of this.edges) {
      const length = this.#length(x, a, b), weights = inverseMass[a] + inverseMass[b];
      if (weights === 0 || length === 0) continue;
      const pull = (length - rest) / (length * weights);
      for (let k = 0; k < 3; ++k) {
        const along = pull * (x[3 * b + k] - x[3 * a + k]);
        x[3 * a + k] += inverseMass[a] * along;
        x[3 * b + k] -= inverseMass[b] * along;
      }
    }
  }

  #keepOut({ position, radius }) {
    const { x, inverseMass } = this;
    for (let n = 0; n < inverseMass.length; ++n) {
      const away = [0, 1, 2].map((k) => x[3 * n + k] - position[k]), distance = Math.hypot(...away);
      if (distance >= radius || distance === 0 || inverseMass[n] === 0) continue;
      for (let k = 0; k < 3; ++k) x[3 * n + k] = position[k] + radius / distance * away[k];
    }
  }

  // tools: [{position: [x, y, z], radius}], mm, as organ.placeTools() takes them.
  step(tools) {
    const { x, velocity, before, timeStep } = this;
    before.set(x);
    for (let i = 0; i < x.length; ++i) x[i] += 0.9 * timeStep * velocity[i];  // a tenth is damped
    for (let i = 0; i < this.iterations; ++i) {
      this.#keepLengths();
      tools.forEach((tool) => this.#keepOut(tool));
    }
    for (let i = 0; i < x.length; ++i) velocity[i] = (x[i] - before[i]) / timeStep;
  }
}
