// SPDX-License-Identifier: Apache-2.0
// The organ in a headset, where the browser has one (WebXR): half a metre before whoever wears it,
// drawn for both eyes by WebGL. It stands before page.js in one script with it.

const headset = document.getElementById("headset");
let session = null;
navigator.xr?.isSessionSupported("immersive-vr").then((there) => { headset.hidden = !there; }).catch(() => {});

headset.addEventListener("click", () => {
  if (session) session.end();
  else if (organ) enter().catch((error) => say(`The headset cannot be entered: ${error.message}.`));
});

async function enter() {
  const entered = await navigator.xr.requestSession("immersive-vr");
  try {
    if (!by_graphics) draw_by("gpu");
    if (!by_graphics) throw new Error(reason);
    const layer = await webgl.layerOf(entered), space = await entered.requestReferenceSpace("local");
    entered.updateRenderState({ baseLayer: layer });
    letGo();
    session = entered;
    session.addEventListener("end", leave, { once: true });
    running = false;
    headset.textContent = "Leave headset";
    say("The organ is in the headset.");
    show_eyes(layer, space);
  } catch (error) {
    entered.end();
    throw error;
  }
}

function show_eyes(layer, space) {
  let stands = false, stepped = 0;
  const see = (now, frame) => {
    if (!session) return;
    session.requestAnimationFrame(see);
    const viewer = frame.getViewerPose(space);
    if (!viewer) return;  // it is not worn, or lost its way
    try {
      if (!stands) organ.standBefore(viewer);
      stands = true;
      // Headsets show 72 pictures a second or more; time goes by in sixtieths.
      if (now - stepped > kStep) organ.passTime(), stepped = Math.max(stepped + kStep, now - kStep);
      for (const view of viewer.views) {
        const place = layer.getViewport(view);
        if (!place) continue;
        webgl.showIn(layer, place);
        organ.look(view, place.width, place.height);
      }
      if (!organ.graphics) session.end();
    } catch (error) {
      session.end();
      fail(error);
    }
  };
  session.requestAnimationFrame(see);
}

function leave() {
  session = null;
  webgl.showIn(null);
  headset.textContent = "Enter headset";
  shown = false;
  say("The organ is back in the page.");
  wake();
}
