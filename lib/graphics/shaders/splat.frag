// SPDX-License-Identifier: Apache-2.0
// A pixel for which a sample may stand: the nearest of its camera's wins, as by drawing/splat.h.
flat in vec4 by_pixel, depth_by_offset;
flat in vec4 first;
flat in float rows;
flat in uint slot;
uniform float texel_mm, inverse_reach;
layout(location = 0) out uvec2 key;

void main() {
  vec2 cell = floor(gl_FragCoord.xy) - first.xy;
  if (cell.x < 0.0 || cell.y < 0.0 || cell.x >= depth_by_offset.w || cell.y >= rows) discard;
  vec2 offset = first.zw + vec2(dot(by_pixel.xy, cell), dot(by_pixel.zw, cell));
  if (max(abs(offset.x), abs(offset.y)) > 1.0) discard;
  float depth = depth_by_offset.z + dot(depth_by_offset.xy, offset) + kTieTexels * texel_mm * dot(offset, offset);
  gl_FragDepth = max(depth, 1e-6) * inverse_reach;
  uvec2 steps31 = uvec2(ivec2(offset * 31.0 + 32.5));
  key = uvec2(slot, steps31.x | steps31.y << 8);
}
