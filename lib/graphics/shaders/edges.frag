// SPDX-License-Identifier: Apache-2.0
// Between which neighbouring pixels skin ends (finishing/post_process.h): bit 1 where this pixel is
// in front of the one to its right, 2 where it lies behind that, 4 and 8 the same with the one below.
uniform highp sampler2D skin_depths;  // of the skin as it was drawn, before slits were filled
uniform float texel;  // as depths are
layout(location = 0) out uint edges;

float skin_depth(ivec2 at) { return within(at) ? texelFetch(skin_depths, at, 0).r : 1.0; }

uint edge(ivec2 at, ivec2 other, ivec2 way) {
  if (!within(other)) return 0u;
  bool here = skin_at(at), there = skin_at(other);
  if (here && open_at(other)) return 1u;
  if (there && open_at(at)) return 2u;
  if (!here || !there) return 0u;
  float a = skin_depth(at), b = skin_depth(other), gap = abs(a - b);
  // Of the nearer surface, the pixel before, and of the farther one that beyond.
  float before = skin_depth(a < b ? at - way : other + way);
  float beyond = skin_depth(a < b ? other + way : at - way);
  // One pixel of the farther one before the background does not tell.
  if (max(max(a, b), beyond) >= 1.0 || gap <= kStepTexels * texel) return 0u;
  float front = before >= 1.0 ? 0.0 : abs(before - min(a, b)), behind = abs(beyond - max(a, b));
  if (!(gap > front && gap > 3.0 * behind)) return 0u;
  return a < b ? 1u : 2u;
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  edges = edge(at, at + ivec2(1, 0), ivec2(1, 0)) | edge(at, at + ivec2(0, 1), ivec2(0, 1)) << 2;
}
