// SPDX-License-Identifier: Apache-2.0
// WebGL 2 for organ.wasm, which draws in the words of OpenGL ES 3.0: what it calls goes to the context
// of a canvas. Objects have numbers there, of which this keeps the list; of shaders the module tells
// the names alone, whose texts are in organ.glsl.
//
//   const graphics = new WebGl(shaderText), organ = await Organ.open(moduleBytes, packBytes, graphics);
//   organ.drawBy(graphics, document.createElement("canvas"));

// Calls that pass their arguments on, with the places of objects among them.
const kCalls = {
  activeTexture: [], attachShader: [0, 1], beginTransformFeedback: [], bindBuffer: [1], bindBufferBase: [2],
  bindTexture: [1], bindVertexArray: [0], blendEquation: [],
  checkFramebufferStatus: [], colorMask: [], compileShader: [0], depthFunc: [], depthMask: [], disable: [],
  drawArrays: [], drawArraysInstanced: [], enable: [], enableVertexAttribArray: [], endTransformFeedback: [],
  framebufferTexture2D: [3], framebufferTextureLayer: [2], linkProgram: [0], pixelStorei: [], texParameteri: [],
  uniform1f: [0], uniform1i: [0], useProgram: [0], vertexAttribDivisor: [], vertexAttribPointer: [], viewport: [],
};
const kMade = ["Buffer", "Framebuffer", "Texture", "VertexArray"];
// Kinds of numbers by the names of OpenGL, and by the letters of its uniforms.
const kKinds = { 0x1400: Int8Array, 0x1401: Uint8Array, 0x1405: Uint32Array, 0x1406: Float32Array,
                 f: Float32Array, i: Int32Array, ui: Uint32Array };
const kColor = 0x1800, kRenderer = 0x1F01, kContextLost = 0x0507;

export class WebGl {
  #gl = null;
  #objects = [null];
  #module = null;  // its exports
  #unsure = true;  // memory was asked for since the last look for errors
  #shownIn = { framebuffer: null, x: 0, y: 0 };
  headset = false;  // whether a headset may ask for the next canvas's context
  calls = {};      // what the module imports

  constructor(shaders) {
    const parts = shaders.split(/^@(.*)\n/m), files = new Map();
    for (let i = 1; i < parts.length; i += 2) files.set(parts[i], parts[i + 1]);
    const calls = this.calls, named = (name) => this.#objects[name] ?? null;
    for (const [name, places] of Object.entries(kCalls)) {
      calls[`gl${name[0].toUpperCase()}${name.slice(1)}`] = (...values) => {
        for (const place of places) values[place] = named(values[place]);
        return this.#gl[name](...values);
      };
    }
    for (const kind of kMade) {
      calls[`glGen${kind}s`] = (count, at) =>
        this.#put(Uint32Array, at, Array.from({ length: count }, () => this.#keep(this.#gl[`create${kind}`]())));
      calls[`glDelete${kind}s`] = (count, at) => {
        for (const name of this.#view(Uint32Array, at, count)) this.#drop(`delete${kind}`, name);
      };
    }
    for (const kind of ["Shader", "Program"]) {
      calls[`glCreate${kind}`] = (...values) => this.#keep(this.#gl[`create${kind}`](...values));
      calls[`glDelete${kind}`] = (name) => this.#drop(`delete${kind}`, name);
      calls[`glGet${kind}iv`] = (name, what, at) =>
        this.#put(Int32Array, at, [Number(this.#gl[`get${kind}Parameter`](named(name), what))]);
      calls[`glGet${kind}InfoLog`] = (name, room, length, at) =>
        this.#write(this.#gl[`get${kind}InfoLog`](named(name)) ?? "", at, room);
    }
    for (const [ending, size] of [["2f", 2], ["3f", 3], ["4f", 4], ["2i", 2], ["3i", 3], ["3ui", 3]]) {
      const Kind = kKinds[ending.slice(1)];
      calls[`glUniform${ending}v`] = (place, count, at) =>
        this.#gl[`uniform${ending}v`](named(place), this.#view(Kind, at, size * count));
    }
    Object.assign(calls, {
      glUniformMatrix3fv: (place, count, transposed, at) =>
        this.#gl.uniformMatrix3fv(named(place), transposed, this.#view(Float32Array, at, 9 * count)),
      glShaderSource: (shader, count, texts) =>
        this.#gl.shaderSource(named(shader), this.#texts(count, texts).join("")
          .replace(/^@(.*)\n/gm, (line, name) => files.get(name))),
      glTransformFeedbackVaryings: (program, count, texts, mode) =>
        this.#gl.transformFeedbackVaryings(named(program), this.#texts(count, texts), mode),
      glGetUniformLocation: (program, at) => {
        const place = this.#gl.getUniformLocation(named(program), this.#text(at));
        return place ? this.#keep(place) : -1;
      },
      glClearBufferfv: (buffer, number, at) =>
        this.#gl.clearBufferfv(buffer, number, this.#view(Float32Array, at, buffer === kColor ? 4 : 1)),
      glBindFramebuffer: (target, name) =>
        this.#gl.bindFramebuffer(target, name ? named(name) : this.#shownIn.framebuffer),
      glBlitFramebuffer: (...values) => {  // from a picture to where it is shown
        const { x, y } = this.#shownIn;
        [x, y, x, y].forEach((by, k) => { values[4 + k] += by; });
        this.#gl.blitFramebuffer(...values);
      },
      glBufferData: (target, bytes, at, usage) => {  // all empty
        this.#unsure = true;
        this.#gl.bufferData(target, bytes, usage);
      },
      glTexImage2D: (...values) => this.#texels("texImage2D", values),
      glTexSubImage2D: (...values) => this.#texels("texSubImage2D", values),
      glTexImage3D: (...values) => this.#texels("texImage3D", values),
      glReadPixels: (...values) => this.#texels("readPixels", values),
      glGetFloatv: (what, at) => this.#put(Float32Array, at, [this.#gl.getParameter(what)].flatMap((v) => [...v])),
      glGetIntegerv: (what, at) => this.#put(Int32Array, at, [this.#gl.getParameter(what)]),
      glGetString: (what) => what === kRenderer && this.#gl ? this.#sent(this.#name()) : 0,
      glGetError: () => this.#gl.isContextLost() ? kContextLost : this.#error(),
    });
  }

  // To ask costs a wait for all that was begun, so only where memory may have been wanting.
  #error() {
    if (!this.#unsure) return 0;
    this.#unsure = false;
    return this.#gl.getError();
  }

  // Takes a canvas that has no other context. Throws an Error whose message is a sentence.
  open(canvas, module, software) {
    this.#module = module;
    this.#objects = [null];
    this.#unsure = true;
    this.#gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false,
                                             xrCompatible: this.headset,
                                             failIfMajorPerformanceCaveat: !software });
    if (!this.#gl) throw new Error(`this browser offers no WebGL 2${software ? "" : " by graphics hardware"}`);
  }

  // A headset's layer for the pictures, and where in it the next ones are shown; null: in the canvas.
  async layerOf(session) {
    await this.#gl.makeXRCompatible();
    return new XRWebGLLayer(session, this.#gl, { alpha: false, antialias: false, depth: false, stencil: false });
  }
  showIn(layer, { x, y } = { x: 0, y: 0 }) {
    this.#shownIn = { framebuffer: layer?.framebuffer ?? null, x, y };
  }

  #name() {
    const told = this.#gl.getExtension("WEBGL_debug_renderer_info");  // where it is not told without
    return this.#gl.getParameter(told ? told.UNMASKED_RENDERER_WEBGL : kRenderer);
  }
  #keep(object) { return this.#objects.push(object) - 1; }
  #drop(how, name) {
    if (this.#objects[name]) this.#gl[how](this.#objects[name]);
    this.#objects[name] = null;
  }
  #view(Kind, at, count) { return new Kind(this.#module.memory.buffer, at, count); }
  #put(Kind, at, values) { this.#view(Kind, at, values.length).set(values); }
  #text(at) {
    const bytes = this.#view(Uint8Array, at);
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  }
  #texts(count, at) { return Array.from(this.#view(Uint32Array, at, count), (text) => this.#text(text)); }
  #write(text, at, room) {
    const bytes = new TextEncoder().encode(text).subarray(0, Math.max(0, room - 1));
    this.#put(Uint8Array, at, [...bytes, 0]);
  }
  #sent(text) {
    const at = this.#module.organ_reserve(text.length + 1);
    this.#write(text, at, text.length + 1);
    return at;
  }
  // The last of the arguments are a kind of numbers and where they lie; 0: nowhere.
  #texels(how, values) {
    this.#unsure ||= how.startsWith("texImage");
    const at = values.pop(), view = at === 0 ? null : this.#view(kKinds[values.at(-1)], at);
    this.#gl[how](...values, view);
  }
}
