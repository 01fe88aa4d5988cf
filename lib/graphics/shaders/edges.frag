// SPDX-License-Identifier: Apache-2.0
// Between which neighbouring pixels skin ends (finishing/front_edges.h): bit 1 where this pixel is
// in front of the one to its right, 2 where it lies behind that, 4 and 8 the same with the one below.
uniform highp sampler2D skin_depths;  // of the skin as it was drawn, before holes were filled
uniform float texel;  // as depths are
layout(location = 0) out uint edges;

float skin_depth(ivec2 at) { return within(at) ? texelFetch(skin_depths, at, 0).r : 1.0; }
float slope(float a, float b) { return a >= 1.0 || b >= 1.0 ? 0.0 : abs(a - b); }

uint edge(ivec2 at, ivec2 other, ivec2 way) {
  if (!within(other)) return 0u;
  bool here = skin_at(at), there = skin_at(other);
  if (here && open_at(other)) return 1u;
  if (there && open_at(at)) return 2u;
  if (!here || !there) return 0u;
  float a = skin_depth(at), b = skin_depth(other), gap = abs(a - b);
  if (a >= 1.0 || b >= 1.0 || gap <= kStepTexels * texel) return 0u;
  float before = slope(skin_depth(at - way), a), after = slope(b, skin_depth(other + way));
  float front = a < b ? before : after, behind = a < b ? after : before;
  if (!(gap > front && gap > 3.0 * behind)) return 0u;
  return a < b ? 1u : 2u;
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  edges = edge(at, at + ivec2(1, 0), ivec2(1, 0)) | edge(at, at + ivec2(0, 1), ivec2(0, 1)) << 2;
}
