// SPDX-License-Identifier: Apache-2.0
// Loads organ.wasm and a pack, and draws the organ: for the page of `organbake export --format web`
// and for pages of your own. Pixels are those of the last picture, (0, 0) its upper left corner.
//
//   const organ = await Organ.open(moduleBytes, packBytes);
//   if (organ.draw(true, 640, 480)) organ.paint(context);

export const Solver = { springs: 0, fem: 1 };
const kTools = ["poke", "grab", "cut", "snip", "pierce"];
// The lists of a mesh in the module's order, and their kinds of number.
const kMeshLists = [
  ["vertices", Float64Array], ["faces", Uint32Array], ["vertexMass", Float64Array],
  ["vertexAnchors", Uint32Array], ["springEnds", Uint32Array], ["springLength", Float64Array],
  ["springStiffness", Float64Array], ["springDamping", Float64Array], ["nodes", Float64Array],
  ["tetrahedra", Uint32Array], ["fill", Float64Array], ["nodeMass", Float64Array],
  ["nodeAnchors", Uint32Array], ["vertexTetrahedron", Uint32Array], ["vertexWeights", Float64Array],
  ["skinFirst", Uint32Array], ["skinCarriers", Uint32Array], ["skinWeights", Float64Array],
  ["skinFaces", Uint32Array], ["tissue", Float64Array]];
const kTissue = ["youngModulusKPa", "density", "thickness", "volumeStiffness", "poissonRatio", "damping"];

async function inflated(stream, bytes, what) {
  const refused = `the file is damaged where it holds the ${what}`;
  const result = new Uint8Array(bytes);
  let at = 0;
  try {
    const reader = new Blob([stream]).stream().pipeThrough(new DecompressionStream("gzip")).getReader();
    for (;;) {
      const { done, value } = await reader.read();
      if (done) break;
      if (at + value.length > bytes) {
        await reader.cancel();
        throw new Error(refused);
      }
      result.set(value, at);
      at += value.length;
    }
  } catch {  // the browser found a wrong checksum, or no gzip stream
    throw new Error(refused);
  }
  if (at !== bytes) throw new Error(refused);
  return result;
}

export class Organ {
  #exports;
  #pack;
  #width = 0;
  #height = 0;
  #supplies = new Map();  // by camera: the promise that the module gets its maps
  #failure = null;
  #next = 0;  // cameras before it are bound
  #figures = [];  // the names of the module's
  #room = null;  // a view of the module's memory where states go
  #canvas = null;  // that graphics hardware draws into

  // module: the bytes of organ.wasm, or a compiled WebAssembly.Module; pack: a Uint8Array; webgl: a
  // WebGl (webgl.js) for drawBy(). Throws an Error whose message is a sentence for the reader.
  static async open(module, pack, webgl = null) {
    const organ = new Organ();
    await organ.#start(module, webgl?.calls);
    await organ.#read(pack);
    return organ;
  }

  async #start(module, calls) {
    const memory = () => new DataView(this.#exports.memory.buffer);
    const imports = {
      // What belongs to WebGL, and what a page need not answer.
      env: new Proxy({}, { get: (none, name) => calls?.[name] ?? (() => 0) }),
      wasi_snapshot_preview1: {
        clock_time_get(clock, precision, at) {
          memory().setBigUint64(at, BigInt(Math.round(1e6 * performance.now())), true);
          return 0;
        },
        proc_exit(code) { throw new Error(`the player ended with ${code}`); },
        fd_write: () => 8, fd_read: () => 8, fd_seek: () => 8, fd_close: () => 8,
        environ_sizes_get(count, bytes) {
          memory().setUint32(count, 0, true);
          memory().setUint32(bytes, 0, true);
          return 0;
        },
        environ_get: () => 0,
      },
    };
    const made = await WebAssembly.instantiate(module, imports);
    this.#exports = (made.instance ?? made).exports;
    this.#exports._initialize();
    this.#figures = this.#named("organ_figure_name");
  }

  async #read(pack) {
    const most = 65536;  // bytes of contents
    this.#give(pack.subarray(0, most));
    const parts = this.#call("organ_contents", pack.length);
    this.#pack = Array.from({ length: parts }, (_, p) => {
      const [offset, packed, bytes] = [0, 1, 2].map((what) => this.#exports.organ_part(p, what));
      return { stream: pack.subarray(offset, offset + packed), bytes };
    });
    this.#give(await inflated(this.#pack[0].stream, this.#pack[0].bytes, "frame"));
    this.#call("organ_open");
  }

  #give(bytes) {
    const at = this.#exports.organ_reserve(bytes.length);
    if (at === 0 && bytes.length > 0) throw new Error(this.#message() || "there is too little memory");
    new Uint8Array(this.#exports.memory.buffer).set(bytes, at);
  }
  #message() {
    const { organ_message, organ_message_bytes, memory } = this.#exports;
    return new TextDecoder().decode(
      new Uint8Array(memory.buffer, organ_message(), organ_message_bytes()).slice());
  }
  #call(name, ...values) {
    const result = this.#exports[name](...values);
    if (result < 0) throw new Error(this.#message());
    return result;
  }

  #supply(camera) {
    if (!this.#supplies.has(camera)) this.#supplies.set(camera, this.#supplied(camera));
    return this.#supplies.get(camera);
  }
  async #supplied(camera) {
    const part = this.#pack[1 + camera];
    this.#give(await inflated(part.stream, part.bytes, `maps of camera ${camera}`));
    this.#call("organ_supply", camera);
    part.stream = null;
  }

  // Draws with graphics hardware from now on, into a canvas of its own that has no context yet; with
  // software WebGL as well when that will do. Returns its name. The first picture is held against the
  // processor's. Throws an Error where it cannot be; `drawingNote` tells why a later picture is the
  // processor's all the same. When the canvas has lost its context, give the organ back to the
  // processor: drawBy(null). Nothing of its state is lost either way.
  drawBy(webgl, canvas = null, { software = false } = {}) {
    this.#exports.organ_draw_by_processor();
    this.#canvas = null;
    if (!webgl) return "";
    webgl.open(canvas, this.#exports, software);
    this.#call("organ_draw_by_graphics", software ? 1 : 0);
    this.#canvas = canvas;
    return this.#message();
  }
  get drawingNote() { return this.#exports.organ_drawing_note(), this.#message(); }

  // One time step of a 60th of a second, unless `step` is false, and a picture. False while the maps
  // that it needs are on their way: ask again, without a step.
  draw(step, width, height) {
    if (this.#failure) throw this.#failure;
    if (this.#canvas && (this.#canvas.width !== width || this.#canvas.height !== height))
      Object.assign(this.#canvas, { width, height });
    return this.#arrived(this.#call("organ_advance", step ? 1 : 0, width, height), width, height);
  }
  #arrived(wanted, width, height) {
    if (wanted > 0) {
      this.#supply(wanted - 1).catch((error) => { this.#failure = error; });
      return false;
    }
    this.#width = width;
    this.#height = height;
    return true;
  }
  // The same, when it is there.
  async drawn(step, width, height) {
    for (; !this.draw(step, width, height); step = false)
      await Promise.all(this.#supplies.values());
  }
  // For a headset (WebXR): the organ, as it is seen now, stands half a metre before an XRViewerPose;
  // what one of its XRViews sees, as draw() draws; and a time step, without a picture.
  standBefore({ transform }) {
    this.#giveMatrices(transform.matrix);
    this.#call("organ_stand_before");
  }
  look({ transform, projectionMatrix }, width, height) {
    if (this.#failure) throw this.#failure;
    this.#giveMatrices(transform.inverse.matrix, projectionMatrix);
    return this.#arrived(this.#call("organ_look", width, height), width, height);
  }
  passTime() { this.#call("organ_pass_time"); }
  #giveMatrices(...matrices) {
    this.#roomFor(Float64Array, 16 * matrices.length).set(matrices.flatMap((one) => [...one]));
  }
  // Puts the last picture into a canvas's 2D context, at once: graphics hardware keeps it no longer.
  paint(context) {
    if (this.graphics) context.drawImage(this.#canvas, 0, 0);
    else context.putImageData(this.picture(), 0, 0);
  }
  // The last picture, until the next one is drawn, R G B A of its pixels, top row first; of those by
  // the processor.
  picture() { return new ImageData(this.pixels(), this.#width, this.#height); }
  pixels() {
    const at = this.#exports.organ_pixels(), bytes = 4 * this.#width * this.#height;
    return new Uint8ClampedArray(this.#exports.memory.buffer, at, bytes);
  }

  // Makes one camera more ready, so that turning never waits; false when all are.
  async loadNext() {
    if (this.#next >= this.cameras) return false;
    await this.#supply(this.#next);
    this.#call("organ_bind_next");
    return ++this.#next < this.cameras;
  }

  async loadAll() { while (await this.loadNext()); }

  // Plays an interaction (the document of `organplay --script`) from rest up to a frame, whose
  // picture is then the last one. Returns how many frames were played.
  async play(script, frame) {
    for (let camera = 0; camera < this.cameras; ++camera) await this.#supply(camera);
    await this.loadAll();
    this.#give(new TextEncoder().encode(JSON.stringify(script)));
    const frames = this.#call("organ_script", frame);
    [this.#width, this.#height] = script.size ?? [1280, 720];
    return frames;
  }

  // What a solver of your own needs, at rest: millimetres, kilograms, N/mm; flat arrays of x y z, and
  // of indices. `tissue` tells its constants. As embedded_player.h says of its Mesh.
  mesh() {
    const mesh = {};
    kMeshLists.forEach(([name, Kind], which) => { mesh[name] = this.#list("organ_mesh", Kind, which); });
    mesh.tissue = Object.fromEntries(kTissue.map((name, i) => [name, mesh.tissue[i]]));
    return mesh;
  }
  // Where your solver has brought the proxy's vertices, or the tetrahedra's nodes: a Float64Array or
  // Float32Array of x y z, world mm. draw(false, …) then shows it; a step goes on from there, from
  // rest in that moment. Throws for another count, for what is not finite, for another organ's or
  // other units, and has changed nothing then.
  setVertices(xyz) { this.#setState(xyz, 0); }
  setNodes(xyz) { this.#setState(xyz, 1); }
  // Tools in the next pictures, which push nothing: [{position: [x, y, z], radius, axis: [x, y, z]}].
  placeTools(tools) { this.#call("organ_place_tools", this.#giveTools(tools)); }
  // For solvers without contact: x y z of the force (N) on each vertex, or each node, that keeps the
  // tissue off tools, or carries it (grabs: true), for one time step.
  contactForces(tools, { nodes = false } = {}) {
    return this.#list("organ_contact_forces", Float64Array, this.#giveTools(tools), nodes ? 1 : 0);
  }
  #roomFor(Kind, numbers) {
    const { memory } = this.#exports;
    const fits = this.#room instanceof Kind && this.#room.length === numbers &&
                 this.#room.buffer === memory.buffer;
    if (fits) return this.#room;
    const at = this.#exports.organ_room(numbers * Kind.BYTES_PER_ELEMENT);
    if (at === 0 && numbers > 0) throw new Error(this.#message());
    return this.#room = new Kind(memory.buffer, at, numbers);
  }
  #setState(xyz, nodes) {
    const Kind = xyz instanceof Float32Array ? Float32Array : Float64Array;
    if (!(xyz instanceof Kind)) throw new TypeError("a state must be a Float64Array or a Float32Array");
    this.#roomFor(Kind, xyz.length).set(xyz);
    this.#call("organ_set_state", xyz.length, nodes, Kind === Float32Array ? 1 : 0);
  }
  #giveTools(tools) {
    const numbers = tools.flatMap(({ position, radius = 5, axis = [0, 0, 0], grabs = false }) =>
      [...position, radius, ...axis, grabs ? 1 : 0]);
    this.#roomFor(Float64Array, numbers.length).set(numbers);
    return tools.length;
  }
  #list(name, Kind, ...values) {
    const bytes = this.#call(name, ...values);
    const at = this.#exports.organ_list();
    return new Kind(this.#exports.memory.buffer.slice(at, at + bytes));
  }

  turn(x, y) { this.#exports.organ_turn(x, y); }    // the organ follows the pointer round its centre
  shift(x, y) { this.#exports.organ_shift(x, y); }  // and across the picture
  zoom(steps) { this.#exports.organ_zoom(steps); }  // > 0 comes nearer
  faceFront() { this.#exports.organ_face_front(); }
  // Puts a tool onto the tissue; false where there is none. "poke" presses along the line of sight,
  // as deep as it is then dragged; "grab" carries the tissue across the view; "pierce" is a needle
  // along the line of sight. With tetrahedra (canCut), once loadAll() is done: "cut" draws a blade
  // across the view; "snip" opens scissors as it is dragged away, and cuts when dragged back.
  touch(x, y, tool = "poke") { return this.#call("organ_touch", x, y, kTools.indexOf(tool)) === 1; }
  drag(x, y) { this.#exports.organ_drag(x, y); }
  push(mm) { this.#exports.organ_push(mm); }  // a held tool, away from the eye when > 0
  letGo() { this.#exports.organ_let_go(); }
  reset() { this.#exports.organ_reset(); }  // the organ at rest
  // The last touch; the next pictures bring the organ there, as long as `seeking`.
  undo() { this.#exports.organ_undo(); }
  redo() { this.#exports.organ_redo(); }
  // Who plays the organ, also after resets; what was done is done again under it.
  set solver(solver) { this.#call("organ_set_solver", solver); }
  set scopeMm(mm) { this.#exports.organ_set_scope(mm); }  // from the lens to the skin straight ahead
  set viewAngle(degrees) { this.#exports.organ_set_view_angle(degrees); }  // across the smaller side
  set radius(mm) { this.#exports.organ_set_radius(mm); }  // of the next touch
  // What a tool of touch() has beside its radius: [{name, title, least, most, usual, value}], and a
  // new value for its next touch.
  toolNumbers(tool) {
    const numbers = [], which = kTools.indexOf(tool);
    while (this.#call("organ_tool_number", which, numbers.length) === 1) {
      const [name, title] = this.#message().split("\n"), at = this.#exports.organ_list();
      const [value, least, most, usual] = new Float64Array(this.#exports.memory.buffer.slice(at, at + 32));
      numbers.push({ name, title, least, most, usual, value });
    }
    return numbers;
  }
  setToolNumber(tool, name, value) {
    const place = this.toolNumbers(tool).findIndex((number) => number.name === name);
    if (place < 0) throw new TypeError(`"${tool}" has no ${name}`);
    this.#call("organ_set_tool_number", kTools.indexOf(tool), place, value);
  }
  set light(light) { this.#call("organ_set_light", light); }
  set background([red, green, blue]) { this.#exports.organ_set_background(red, green, blue); }

  // What the lights are called, in the order of their numbers, as many as the organ can be shown in.
  get lightTitles() { return this.#named("organ_light_title").slice(0, this.lights); }
  #named(ask) {
    const names = [];
    for (let name; this.#exports[ask](names.length), name = this.#message();) names.push(name);
    return names;
  }
  #figure(name) { return this.#exports.organ_figure(this.#figures.indexOf(name)); }
  get radius() { return this.#figure("radius"); }
  get light() { return this.#figure("light"); }
  get lights() { return this.#figure("lights"); }
  get cameras() { return this.#figure("cameras"); }
  get proxyFaces() { return this.#figure("proxyFaces"); }
  get stepMs() { return this.#figure("stepMs"); }
  get drawMs() { return this.#figure("drawMs"); }
  get forceN() { return this.#figure("forceN"); }
  get depthMm() { return this.#figure("depthMm"); }
  get unchanged() { return this.#figure("unchanged") === 1; }
  get recovered() { return this.#figure("recovered"); }
  get canCut() { return this.#figure("canCut") === 1; }
  get pieces() { return this.#figure("pieces"); }
  get solver() { return this.#figure("solver"); }
  get canUndo() { return this.#figure("canUndo") === 1; }
  get canRedo() { return this.#figure("canRedo") === 1; }
  get seeking() { return this.#figure("seeking") === 1; }
  get scopeMm() { return this.#figure("scopeMm"); }  // 0 where there is no skin ahead
  get viewAngle() { return this.#figure("viewAngle"); }
  get inside() { return this.#figure("inside") === 1; }  // nothing is seen for being too near
  get graphics() { return this.#figure("graphics") === 1; }  // who drew the last picture
  get memoryBytes() { return this.#exports.memory.buffer.byteLength; }
}
