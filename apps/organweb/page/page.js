// SPDX-License-Identifier: Apache-2.0
// The page round the organ: pointer, keys, figures, and a resolution that keeps up.
const element = (id) => document.getElementById(id);
const canvas = element("canvas"), stage = element("stage"), cross = element("cross");
const context = canvas.getContext("2d", { alpha: false });
const kStep = 1000 / 60, kBudget = 14;     // ms: a time step; what a picture may take
const kSlowBudget = 30;                     // ms of pictures that are coarse already
const kMostPixels = 1.4e6, kCoarsePixels = 3.5e5, kFewestPixels = 9e4;
const kFine = 200;                          // ms of rest until the picture is as fine as the screen
const kCalm = 2500;                         // ms of rest until the organ is left alone
// organ.html#pixels=200000 keeps to so many, whatever the machine can do; #draw=gpu or cpu to one way
// of drawing.
const parameters = new URLSearchParams(location.hash.slice(1));
const kAsked = Number(parameters.get("pixels")) || 0;

function bytesOf(id) {
  const holder = element(id), text = holder.textContent;
  holder.remove();
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const letters = atob(text), bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; ++i) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

let organ = null;
let mode = "poke", pixels = kAsked || 7e5, busy = 0;  // busy: ms of a picture, averaged
let complete = false, pieces = 1;  // all cameras are there; what blades have made of the organ
let due = 0, calmSince = 0, running = false, shown = false, ticked = 0;
const pointers = new Map();
let held = null;  // the pointer, or "keys", that holds the tool
let grid = [1, 1];  // of the picture in which it was put onto the tissue

const fail = (error) => {
  running = false;
  organ = null;
  element("loading").hidden = true;
  element("error").hidden = false;
  element("error").textContent = `This organ cannot be shown: ${error.message}.`;
};
const say = (text) => { element("status").textContent = text; };

// Whether the picture's size is another now.
function fit(most) {
  const width = Math.max(1, stage.clientWidth), height = Math.max(1, stage.clientHeight);
  const finest = Math.min(devicePixelRatio || 1, 2);
  const scale = Math.min(finest, Math.sqrt(most / (width * height)));
  const [w, h] = [width, height].map((side) => Math.max(1, Math.round(side * scale)));
  if (canvas.width === w && canvas.height === h) return false;
  canvas.width = w;
  canvas.height = h;
  shown = false;
  return true;
}

// Fewer pixels at once when a picture takes too long; more, slowly, when there is time. Half the
// pictures a second are less of a loss than a picture that looks unlike the fine one.
function adapt(ms) {
  if (kAsked) return;
  busy = busy ? 0.9 * busy + 0.1 * ms : ms;
  const budget = pixels > kCoarsePixels ? kBudget : kSlowBudget;
  if (busy > budget) pixels = Math.max(kFewestPixels, pixels * 0.85);
  else if (busy < 0.55 * kBudget) pixels = Math.min(kMostPixels, pixels * 1.02);
  else return;
  if (busy > budget) busy = 0.8 * budget;
}

function figures() {
  const parts = [`${canvas.width} × ${canvas.height}`, `${(organ.stepMs + organ.drawMs).toFixed(1)} ms`];
  if (held !== null) parts.push(`${organ.depthMm.toFixed(1)} mm`, `${organ.forceN.toFixed(2)} N`);
  if (organ.inside) parts.push("The eye is inside the organ: zoom out, or press V");
  if (organ.pieces > 1) parts.push(`${organ.pieces} pieces`);
  if (organ.pieces !== pieces) say(`The organ is in ${pieces = organ.pieces} piece${pieces > 1 ? "s" : ""}.`);
  element("figures").textContent = parts.join(" · ");
  element("undo").disabled = !organ.canUndo;
  element("redo").disabled = !organ.canRedo;
  if (document.activeElement !== element("scope")) show_scope(organ.scopeMm);
}

// The slider goes by equal shares, from 1 to 400 mm.
const kFarthest = 400;
function show_scope(mm) {
  element("scope").disabled = mm === 0;
  if (mm > 0) element("scope").value = 100 * Math.log(mm) / Math.log(kFarthest);
  element("scope-text").textContent = mm > 0 ? `${mm.toFixed(0)} mm` : "no skin";
}
function bring_scope(mm) {
  organ.scopeMm = mm;
  element("scope-text").textContent = `${mm.toFixed(0)} mm`;
}
function play_by(solver) {
  letGo();
  organ.solver = solver;
  element("solver").value = String(organ.solver);
  say(`The tissue is played by ${element("solver").selectedOptions[0].text}.`);
}
function undo() { letGo(); organ.undo(); say("Undone."); }
function redo() { letGo(); organ.redo(); say("Done again."); }

// Draws, after a time step when it is asked for; whether there was anything new to show.
function show(step) {
  if (!organ.draw(step, canvas.width, canvas.height)) return false;
  if (by_graphics && !organ.graphics) leave_graphics(organ.drawingNote);
  if (organ.unchanged && shown) return false;
  organ.paint(context);
  return shown = true;
}

function tick(now) {
  if (!running || !organ) return;
  requestAnimationFrame(tick);
  if (now < due - 2) return;  // a screen of more than 60 pictures a second
  due = now - due > 4 * kStep ? now + kStep : due + kStep;
  try {
    const fine = now - calmSince > kFine;  // a held tool or not
    const anew = fit(kAsked || (fine ? kMostPixels : pixels));
    const start = performance.now(), since = now - ticked;
    ticked = now;
    if (show(true) && !(fine && anew)) {
      calmSince = now;
      // A step in which a cut grows takes as long for any number of pixels.
      // Graphics hardware works behind the page's back: only late pictures tell that it is busy.
      const late = by_graphics && since > 1.3 * kStep && since < 10 * kStep;
      if (!fine && organ.stepMs < kBudget) adapt(late ? since : performance.now() - start);
    }
    if (organ.seeking) calmSince = now;
    figures();
    if (held === null && now - calmSince > kCalm) running = false;  // until it is touched
  } catch (error) {
    fail(error);
  }
}
function wake() {
  calmSince = performance.now();
  if (running || !organ || document.hidden || session) return;
  running = true;
  due = 0;
  requestAnimationFrame(tick);
}

// Canvas pixels of a place on the screen.
function place(event) {
  const box = canvas.getBoundingClientRect();
  return [(event.clientX - box.left) * canvas.width / box.width,
          (event.clientY - box.top) * canvas.height / box.height];
}

// The tool, onto the tissue at a place of the canvas; the pointer then moves it in pixels of this
// picture, however fine the next ones are.
function hold(at, tool, by) {
  if (!organ.touch(...at, tool)) return false;
  element("solver").value = String(organ.solver);  // a blade has finite elements play it
  held = by;
  grid = [canvas.width, canvas.height];
  return true;
}
function pull(at) {
  organ.drag(at[0] * grid[0] / canvas.width, at[1] * grid[1] / canvas.height);
}

const kBlades = ["cut", "snip"];
function choose(next) {
  if (kBlades.includes(next) && !(organ?.canCut && complete))
    return say(organ?.canCut ? "The organ is not ready to be cut yet." : "This organ cannot be cut.");
  mode = next;
  show_numbers();
  element("radii").hidden = mode === "cut" || mode === "snip" || mode === "pierce";
  for (const button of document.querySelectorAll("[data-mode]"))
    button.setAttribute("aria-pressed", String(button.dataset.mode === mode));
}

// A slider for each number that the chosen tool has of its own.
function show_numbers() {
  element("numbers").replaceChildren(...(organ && mode !== "turn" ? organ.toolNumbers(mode) : []).map((number) => {
    const label = document.createElement("label"), slider = document.createElement("input");
    const [before, after] = number.title.split("%.1f"), text = document.createElement("output");
    Object.assign(slider, { type: "range", id: number.name, min: number.least, max: number.usual, step: 0.1 });
    slider.value = number.value;
    const show = () => { text.textContent = `${Number(slider.value).toFixed(1)}${after}`; };
    slider.addEventListener("input", () => {
      if (organ) organ.setToolNumber(mode, number.name, Number(slider.value));
      show();
    });
    show();
    label.append(before, slider, text);
    return label;
  }));
}

function letGo() {
  if (held === null) return;
  say(`Let go at ${organ.depthMm.toFixed(1)} millimetres and ${organ.forceN.toFixed(2)} newtons.`);
  organ.letGo();
  held = null;
}

function resize_tool(mm) {
  const radius = element("radius");
  radius.value = mm;
  organ.radius = Number(radius.value);
  element("radius-text").textContent = `${Number(radius.value).toFixed(1)} mm`;
}

canvas.addEventListener("pointerdown", (event) => {
  if (!organ) return;
  event.preventDefault();
  canvas.focus({ preventScroll: true });
  cross.hidden = true;
  canvas.setPointerCapture(event.pointerId);
  const at = place(event);
  pointers.set(event.pointerId, at);
  wake();
  if (pointers.size > 1) return letGo();  // two fingers look round
  const tool = event.button === 0 && mode !== "turn" && !event.shiftKey;
  if (tool) hold(at, event.ctrlKey ? "grab" : mode, event.pointerId);
});
canvas.addEventListener("pointermove", (event) => {
  const before = pointers.get(event.pointerId);
  if (!organ || !before) return;
  const at = place(event), by = [at[0] - before[0], at[1] - before[1]];
  wake();
  if (held === event.pointerId) {
    pull(at);
  } else if (pointers.size === 2) {
    const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, p]) => p);
    const apart = (p) => Math.max(1, Math.hypot(p[0] - other[0], p[1] - other[1]));
    organ.zoom(Math.log(apart(before) / apart(at)) / Math.log(0.9));
    organ.shift(by[0] / 2, by[1] / 2);
  } else if (event.shiftKey || event.buttons & 4) {
    organ.shift(...by);
  } else {
    organ.turn(...by);
  }
  pointers.set(event.pointerId, at);
});
for (const end of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(end, (event) => {
    if (!pointers.delete(event.pointerId) || !organ) return;
    if (held === event.pointerId) letGo();
    wake();
  });
}
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
// Inside somebody else's page the wheel is theirs until the organ was touched.
const embedded = window.self !== window.top;
canvas.addEventListener("wheel", (event) => {
  if (!organ || embedded && document.activeElement !== canvas) return;
  event.preventDefault();
  const steps = -event.deltaY / (event.deltaMode === 0 ? 100 : 3);
  if (held !== null) organ.push(2 * steps);
  else organ.zoom(steps);
  wake();
}, { passive: false });

// The cross of the keyboard, in shares of the canvas.
const aim = [0.5, 0.5];
function show_cross() {
  cross.hidden = false;
  cross.style.left = `${100 * aim[0]}%`;
  cross.style.top = `${100 * aim[1]}%`;
}
function press() {
  show_cross();
  if (held === "keys") return organ.push(1);
  if (held !== null) return;
  const at = [aim[0] * canvas.width, aim[1] * canvas.height];
  if (!hold(at, mode === "turn" ? "poke" : mode, "keys")) return say("There is no tissue at the cross.");
  say(mode === "grab" ? "Grabbed." : "Touching.");
  organ.push(1);
}
const turned = 24;  // pixels of a key's turn
const kKeys = {
  ArrowLeft: () => steer(-1, 0), ArrowRight: () => steer(1, 0),
  ArrowUp: () => steer(0, -1), ArrowDown: () => steer(0, 1),
  A: () => move(-1, 0), D: () => move(1, 0), W: () => move(0, -1), S: () => move(0, 1),
  "+": () => organ.zoom(1), "=": () => organ.zoom(1), "-": () => organ.zoom(-1),
  " ": press, p: () => choose("poke"), g: () => choose("grab"),
  c: () => choose("cut"), x: () => choose("snip"), n: () => choose("pierce"), t: () => choose("turn"),
  r: () => reset(), v: () => organ.faceFront(), l: () => next_light(), f: () => full(), s: () => save(),
  z: undo, y: redo, m: () => { if (organ.canCut) play_by(1 - organ.solver); },
  ",": () => organ.scopeMm && bring_scope(organ.scopeMm / 1.15),
  ".": () => organ.scopeMm && bring_scope(organ.scopeMm * 1.15),
  "[": () => resize_tool(Number(element("radius").value) - 1),
  "]": () => resize_tool(Number(element("radius").value) + 1),
  h: () => { element("about").open = !element("about").open; },
};
function steer(x, y) {
  if (held === "keys") {  // pulls what is grabbed
    aim[0] += x * turned / canvas.width;
    aim[1] += y * turned / canvas.height;
    pull([aim[0] * canvas.width, aim[1] * canvas.height]);
    show_cross();
  } else {
    organ.turn(x * turned, y * turned);
  }
}
function move(x, y) {
  aim[0] = Math.min(1, Math.max(0, aim[0] + 0.02 * x));
  aim[1] = Math.min(1, Math.max(0, aim[1] + 0.02 * y));
  show_cross();
}
canvas.addEventListener("keydown", (event) => {
  const act = kKeys[event.key];
  if (!organ || !act || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  wake();
  act();
});
canvas.addEventListener("keyup", (event) => {
  if (organ && event.key === " " && held === "keys") letGo();
  wake();
});
canvas.addEventListener("blur", () => {
  cross.hidden = true;
  if (organ && held === "keys") letGo();
});

function reset() {
  letGo();
  organ.reset();
  element("solver").value = String(organ.solver);
  say("The organ is at rest.");
}
function next_light() {
  const light = element("light");
  if (organ.lights < 2) return;
  light.selectedIndex = (light.selectedIndex + 1) % light.options.length;
  organ.light = Number(light.value);
  say(`Light ${light.selectedOptions[0].text}.`);
}
function full() {
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen?.().catch(() => say("The browser shows no full screen."));
}
function save() {
  canvas.toBlob((blob) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `${document.title.replace(/[^\w-]+/g, "_")}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    say("The picture is saved.");
  });
}
const press_of = { reset, undo, redo, front: () => organ.faceFront(), save, full };
for (const [id, act] of Object.entries(press_of)) {
  element(id).addEventListener("click", () => { if (organ) act(), wake(); });
}
for (const button of document.querySelectorAll("[data-mode]"))
  button.addEventListener("click", () => choose(button.dataset.mode));
element("radius").addEventListener("input", () => { if (organ) resize_tool(element("radius").value), wake(); });
element("light").addEventListener("change", () => { if (organ) organ.light = Number(element("light").value), wake(); });
element("scope").addEventListener("input", () => {
  if (organ) bring_scope(kFarthest ** (Number(element("scope").value) / 100)), wake();
});
element("solver").addEventListener("change", () => { if (organ) play_by(Number(element("solver").value)), wake(); });
element("painter").addEventListener("change", () => { if (organ) draw_by(element("painter").value), wake(); });
document.addEventListener("visibilitychange", () => {
  if (document.hidden) running = false;
  else wake();
});
new ResizeObserver(() => { shown = false; wake(); }).observe(stage);
const ground = [22, 23, 26];  // of the stage, in a light page as in a dark one

async function unpacked(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

try {
  if (typeof WebAssembly !== "object" || typeof DecompressionStream !== "function")
    throw new Error("this browser is too old for it; any of the last two years shows it");
  webgl = new WebGl(new TextDecoder().decode(await unpacked(bytesOf("shaders"))));
  const opened = await Organ.open(await unpacked(bytesOf("module")), bytesOf("pack"), webgl);
  fit(pixels);
  opened.background = ground;
  await opened.drawn(false, canvas.width, canvas.height);
  opened.paint(context);
  stage.classList.remove("loading");
  performance.mark("organ shown");
  organ = opened;
  resize_tool(organ.radius);
  element("light").replaceChildren(...organ.lightTitles.map((title, light) => new Option(title, light)));
  element("light").value = String(organ.light);
  element("lights").hidden = organ.lights < 2;
  for (const blade of kBlades) document.querySelector(`[data-mode=${blade}]`).hidden = !organ.canCut;
  element("solvers").hidden = !organ.canCut;
  element("solver").value = String(organ.solver);
  element("loading").hidden = true;
  window.organ = organ;  // for whoever writes a script in the browser's console
  const choice = parameters.get("draw");
  draw_by(["cpu", "gpu"].includes(choice) ? choice : "auto");
  wake();
  // The other cameras, one at a time, whenever nothing is touched.
  const rest = async () => {
    try {
      if (!organ) return;
      if (held === null && !await organ.loadNext()) return void (complete = true);
      setTimeout(rest, 50);
    } catch (error) {
      fail(error);
    }
  };
  setTimeout(rest, 200);
} catch (error) {
  fail(error);
}
