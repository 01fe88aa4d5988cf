// SPDX-License-Identifier: Apache-2.0
// Pixels that look through the skin at what lies behind (finishing/see_through.h) become open.
layout(location = 0) out vec4 shown;
uniform float texel;  // as depths are
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  shown = color_at(at);
  float here = depth_at(at);
  gl_FragDepth = here;
  if (here >= 1.0) return;
  float sides = max(min(depth_at(at + ivec2(-1, 0)), depth_at(at + ivec2(-2, 0))),
                    min(depth_at(at + ivec2(1, 0)), depth_at(at + ivec2(2, 0))));
  float ends = max(min(depth_at(at + ivec2(0, -1)), depth_at(at + ivec2(0, -2))),
                   min(depth_at(at + ivec2(0, 1)), depth_at(at + ivec2(0, 2))));
  if (min(sides, ends) < here - kStepTexels * texel) shown.a = 0.0;
}
