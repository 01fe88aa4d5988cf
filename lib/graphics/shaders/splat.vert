// SPDX-License-Identifier: Apache-2.0
// One sample: where its splat begins, how far that pixel's centre lies from it, its depth. As
// lib/warp's drawing/splat.cpp places it.
layout(location = 0) in mat3 plane;
layout(location = 3) in mat3 outward;
layout(location = 6) in mat3 bend;
layout(location = 9) in vec4 texel_per_pixel;
layout(location = 10) in vec4 splat;
uniform highp usampler2D samples;
uniform vec2 picture;
uniform bool skip_nearest;  // texels beyond the largest splat: the base layer is smooth

flat out vec4 by_pixel, depth_by_offset;  // z_u, z_v, the sample's depth; columns
flat out vec4 first;                      // pixel, and its offset
flat out float rows;
flat out uint slot;

void main() {
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  gl_PointSize = 1.0;
  by_pixel = texel_per_pixel, depth_by_offset = vec4(0.0), first = vec4(0.0);
  rows = splat.w;
  int number = gl_InstanceID * kSlots + gl_VertexID;
  slot = uint(number);
  vec2 cells = splat.zw;
  if (cells.x < 1.0 || (skip_nearest && max(cells.x, cells.y) >= float(kMostSplat))) return;
  uvec2 place = one_of_two(texelFetch(samples, table_at(number >> 1), 0), number);
  ivec2 height_and_use = signed_halves(place.y);
  if (height_and_use.y == 0) return;
  vec3 p = shell_point(plane, outward, bend, vec2(signed_halves(place.x)), float(height_and_use.x));
  if (!(p.z > near_mm)) return;
  vec2 middle = 0.5 * cells, from = p.xy / p.z - (middle + 0.5), pixel = ceil(from);
  if (!(all(greaterThan(pixel + cells, vec2(0.0))) && all(lessThan(pixel, picture)))) return;
  vec2 d = pixel - from - middle;
  first = vec4(pixel, dot(texel_per_pixel.xy, d), dot(texel_per_pixel.zw, d));
  depth_by_offset = vec4(splat.xy, p.z, cells.x);
  vec2 guard = vec2(kMostSplat);
  gl_Position = vec4(2.0 * (pixel + middle + guard) / (picture + 2.0 * guard) - 1.0, 0.0, 1.0);
  gl_PointSize = max(cells.x, cells.y);
}
