// SPDX-License-Identifier: Apache-2.0
// What the passes share that draw instruments, blood and smoke: those in a table, in the view's
// frame, mm, four texels each, and the box of the picture that they touch.
uniform highp sampler2D tools;
uniform int tool_count;
uniform vec4 tool_box;  // pixels
uniform float reach;
uniform bool at_scope;
uniform vec3 light_mm;  // from the eye

vec4 tool(int number, int texel) { return texelFetch(tools, table_at(4 * number + texel), 0); }

bool in_tool_box() {
  return all(greaterThanEqual(gl_FragCoord.xy, tool_box.xy)) &&
         all(lessThanEqual(gl_FragCoord.xy, tool_box.zw));
}

// Of depth 1.
vec3 sight_at(vec2 pixel) { return vec3((pixel - lens.zw) / lens.xy, 1.0); }

float rising(float low, float high, float value) {
  float t = clamp((value - low) / (high - low), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}
