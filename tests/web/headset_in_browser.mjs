// SPDX-License-Identifier: Apache-2.0
// A page in a headset that is none: a stand-in for WebXR, whose two eyes look through frusta that are
// not the same on both sides. Each half of what is shown is the processor's picture of that eye.
// usage: node headset_in_browser.mjs PAGE [FOLDER for screenshots]; exit code 77 without WebGL 2
import { resolve } from "node:path";
import { Browser, find_chromium, sleep } from "./browser.mjs";

const left_out = (why) => {
  console.log(`SKIPPED: ${why}; no page was seen in a headset`);
  process.exit(77);
};
if (!find_chromium()) left_out("there is no Chromium here (Debian: chromium)");
const [page, kept] = process.argv.slice(2);
let failures = 0;
const expect = (holds, what) => {
  if (!holds) console.log(`FAILED: ${what}`), ++failures;
};

// Column by column, metres: who wears it stands at (0.2, 1.6, −0.4), has turned 30° to the left and
// looks 2° down; the eyes are 64 mm apart. Frusta are narrow, as through a spyglass: the organ is
// small.
const turned = (yaw, pitch) => {
  const [a, b] = [Math.sin(yaw), Math.cos(yaw)], [c, d] = [Math.sin(pitch), Math.cos(pitch)];
  return [b, 0, -a, a * c, d, b * c, a * d, -c, b * d];
};
const [yaw, apart, width, height] = [Math.PI / 6, 0.064, 320, 288];
const at = [0.2, 1.6, -0.4], r = turned(yaw, -Math.PI / 90);
const transform = (x) => {  // of what lies x to the right of the head's middle
  const p = [0, 1, 2].map((k) => at[k] + x * r[k]);
  const back = [0, 1, 2].map((k) => -(r[3 * k] * p[0] + r[3 * k + 1] * p[1] + r[3 * k + 2] * p[2]));
  return {
    matrix: [...r.slice(0, 3), 0, ...r.slice(3, 6), 0, ...r.slice(6), 0, ...p, 1],
    inverse: { matrix: [r[0], r[3], r[6], 0, r[1], r[4], r[7], 0, r[2], r[5], r[8], 0, ...back, 1] },
  };
};
// By the tangents of its sides.
const projection = (left, right, bottom, top) =>
  [2 / (right - left), 0, 0, 0, 0, 2 / (top - bottom), 0, 0,
   (right + left) / (right - left), (top + bottom) / (top - bottom), -1, -1, 0, 0, -0.2, 0];
const views = [{ eye: "left", transform: transform(-apart / 2), projectionMatrix: projection(0.02, 0.12, -0.01, 0.08) },
               { eye: "right", transform: transform(apart / 2), projectionMatrix: projection(-0.13, -0.03, -0.01, 0.08) }];
// The pixel of a half in which a point of the room is seen.
const seen_at = ({ transform: { inverse: { matrix: m } }, projectionMatrix: p }, point) => {
  const [x, y, z] = [0, 1, 2].map((k) => m[k] * point[0] + m[4 + k] * point[1] + m[8 + k] * point[2] + m[12 + k]);
  return [(1 + (p[0] * x + p[8] * z) / -z) * width / 2, (1 - (p[5] * y + p[9] * z) / -z) * height / 2];
};

const stand_in = `(() => {
  const views = ${JSON.stringify(views)}.map((view) => ({ ...view,
    projectionMatrix: new Float32Array(view.projectionMatrix) }));
  const [width, height] = [${width}, ${height}];
  window.XRWebGLLayer = class {
    constructor(session, gl, wanted) {
      if (wanted.antialias !== false) throw new Error("pictures cannot be copied into many samples a pixel");
      window.layer = this;
      this.gl = gl;
      this.framebuffer = gl.createFramebuffer();
      gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, 2 * width, height);
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D,
                              gl.getParameter(gl.TEXTURE_BINDING_2D), 0);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      gl.bindTexture(gl.TEXTURE_2D, null);
    }
    getViewport(view) { return { x: view.eye === "left" ? 0 : width, y: 0, width, height }; }
    read() {
      const { gl } = this, pixels = new Uint8Array(8 * width * height);
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
      gl.readPixels(0, 0, 2 * width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      return pixels;
    }
  };
  class Session extends EventTarget {
    frames = 0;
    updateRenderState({ baseLayer }) { if (baseLayer !== layer) throw new Error("whose layer?"); }
    async requestReferenceSpace(kind) { return kind; }
    requestAnimationFrame(draw) {
      setTimeout(() => {
        if (this.ended) return;
        draw(performance.now(), { getViewerPose: () => ({ transform: ${JSON.stringify(transform(0))}, views }) });
        window.seen = layer.read();
        ++this.frames;
      }, 14);
    }
    async end() { this.ended = true; this.dispatchEvent(new Event("end")); }
  }
  const xr = {
    isSessionSupported: async (mode) => mode === "immersive-vr" && !location.hash.includes("seated"),
    requestSession: async (mode) => {
      if (location.hash.includes("refused")) throw new DOMException("nobody may");
      return window.worn = new Session();
    },
  };
  Object.defineProperty(navigator, "xr", { value: location.hash.includes("without") ? undefined : xr });
  WebGL2RenderingContext.prototype.makeXRCompatible = async function () {};
  // The processor's picture of an eye against its half.
  window.agreement = (eye) => {
    if (!organ.look(views[eye], width, height)) throw new Error("maps are missing");
    const pixels = organ.pixels();
    let sum = 0, x_sum = 0, covered = 0;
    for (let y = 0; y < height; ++y)
      for (let x = 0; x < width; ++x) {
        const one = 4 * (y * width + x), other = 4 * ((height - 1 - y) * 2 * width + eye * width + x);
        for (let c = 0; c < 3; ++c) sum += (pixels[one + c] - seen[other + c]) ** 2;
        if (Math.abs(seen[other] - 22) > 12) x_sum += x, ++covered;  // skin is redder than the ground
      }
    return { db: 10 * Math.log10(255 ** 2 * 3 * width * height / Math.max(sum, 1)),
             middle: x_sum / covered, share: covered / width / height };
  };
})();`;

const browser = await Browser.start(900, 700);
await browser.send("Page.addScriptToEvaluateOnNewDocument", { source: stand_in });
const told = () => browser.value('document.getElementById("status").textContent');
const hidden = () => browser.value('document.getElementById("headset").hidden');
const click = () => browser.value('document.getElementById("headset").click()');
const open = async (hash) => {
  await browser.send("Page.navigate", { url: "about:blank" });
  await browser.open(resolve(page), hash);
  await browser.until("window.organ");
  await browser.until('document.getElementById("painted").textContent !== ""');
};

for (const hash of ["#without", "#seated"]) {
  await open(`${hash}&draw=cpu&pixels=40000`);
  await sleep(100);
  expect(await hidden(), `${hash}: a page without a headset offers none`);
}
await open("#refused&draw=gpu&pixels=40000");
await browser.until('!document.getElementById("headset").hidden', 10).catch(() => expect(false, "the button is there"));
if ((await browser.value('document.getElementById("painted").textContent')).includes("offers no WebGL 2")) {
  await browser.close();
  left_out("this Chromium has no software WebGL 2");
}
await click();
await sleep(200);
expect((await told()).includes("cannot be entered: nobody may"), `a refusal is told: ${await told()}`);

// By itself the page leaves software WebGL to the processor; a headset takes what there is.
await open("#pixels=40000");
await browser.until("organ.unchanged", 60);
await click();
await browser.until("window.worn?.frames >= 5", 60).catch(() => expect(false, "frames are drawn"));
await browser.value("organ.loadAll()");
const frames = await browser.value("worn.frames");
await browser.until(`worn.frames >= ${frames + 3}`, 60);
expect((await told()).includes("in the headset"), `it is told: ${await told()}`);
await browser.keep(kept, "headset");
await click();
await browser.until("organ.unchanged", 60).catch(() => expect(false, "the page goes on"));
expect(await browser.value('document.getElementById("headset").textContent') === "Enter headset", "and may be left");
expect(await browser.value("organ.graphics"), "what draws stays");
expect(await browser.value("layer.gl.getError()") === 0, "OpenGL has nothing to say");

await browser.value(`organ.drawBy(null)`);
const halves = [await browser.value("agreement(0)"), await browser.value("agreement(1)")];
for (const [eye, { db, share }] of halves.entries()) {
  console.log(`${views[eye].eye} eye: ${db.toFixed(2)} dB, skin in ${(100 * share).toFixed(0)} %`);
  expect(share > 0.1, `the ${views[eye].eye} eye sees the organ`);
  expect(db >= 40, `the ${views[eye].eye} half is the processor's picture (${db.toFixed(2)} dB)`);
}
// Half a metre ahead of the level gaze, each eye as its own frustum has it.
const center = [at[0] - 0.5 * Math.sin(yaw), at[1], at[2] - 0.5 * Math.cos(yaw)];
const expected = views.map((view) => seen_at(view, center));
const off = halves.map(({ middle }, eye) => middle - expected[eye][0]);
console.log(`the organ's middle beside where it should stand: ${off.map((px) => px.toFixed(1))} px`);
expect(Math.abs(off[0] - off[1]) < 3, "both eyes see it at one distance");
expect(off.every((px) => Math.abs(px) < 0.08 * width), "it stands straight ahead");
expect(browser.complaints.filter((text) => !/GPU stall|software fallback|willReadFrequently/.test(text)).length === 0,
       `nothing complains: ${browser.complaints}`);
await browser.close();
console.log(failures === 0 ? "a headset was entered and left" : `${failures} expectation(s) failed`);
process.exit(failures === 0 ? 0 : 1);
