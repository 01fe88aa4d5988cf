// SPDX-License-Identifier: Apache-2.0
// The page's choice of what draws. It stands before page.js in one script with it.

// Who draws, and why: graphics hardware into a canvas of its own, where there is any that does it
// right; software that does as if only when it is asked for.
let webgl = null, easel = null, by_graphics = false, painter = "", reason = "";
function draw_by(choice) {
  element("painter").value = choice;
  painter = "", reason = "you chose it";
  try {
    webgl.headset = !headset.hidden;
    if (choice === "cpu") organ.drawBy(null);
    else painter = organ.drawBy(webgl, easel ??= new_easel(), { software: choice === "gpu" });
  } catch (error) {
    reason = error.message;
  }
  by_graphics = painter !== "";
  tell_painter();
  shown = false;
}
function new_easel() {
  const made = document.createElement("canvas");
  made.addEventListener("webglcontextlost", () => {
    if (made === easel) easel = null;
    if (!by_graphics || !organ) return;
    organ.drawBy(null);
    leave_graphics("the graphics hardware's context was lost");
    wake();
  });
  return made;
}
function leave_graphics(why) {
  by_graphics = shown = false;
  reason = why;
  tell_painter();
}
function tell_painter() {
  const text = by_graphics ? `WebGL 2 draws the pictures: ${painter}.`
                           : `The processor draws the pictures: ${reason}.`;
  element("painted").textContent = element("painter").title = text;
  say(text);
}
