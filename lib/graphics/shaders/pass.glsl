// SPDX-License-Identifier: Apache-2.0
// A pass that leaves a pixel as it is, but for what its finish() makes of it.
layout(location = 0) out vec4 shown;
void finish(ivec2 at);

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  shown = color_at(at);
  gl_FragDepth = depth_at(at);
  finish(at);
}
