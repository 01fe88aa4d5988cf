// SPDX-License-Identifier: Apache-2.0
// One sample: where its splat begins, how far that pixel's centre lies from it, its depth. As
// lib/warp's drawing/splat.cpp places it.
layout(location = 0) in vec4 matrix0;
layout(location = 1) in vec4 matrix1;
layout(location = 2) in vec4 matrix2;
layout(location = 3) in vec4 matrix3;
layout(location = 4) in vec4 matrix4;
layout(location = 5) in vec4 matrix5;
layout(location = 6) in vec4 matrix6;
layout(location = 7) in vec4 texel_per_pixel;
layout(location = 8) in vec4 splat;
uniform highp usampler2D samples;
uniform vec2 picture;
uniform float near_mm;
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
  if (cells.x < 1.0 || (skip_nearest && max(cells.x, cells.y) >= kMostSplat)) return;
  uvec2 place = one_of_two(texelFetch(samples, table_at(number >> 1), 0), number);
  if (signed_high(place.y) == 0) return;
  float b1 = float(signed_low(place.x)), b2 = float(signed_high(place.x));
  float h = float(signed_low(place.y));
  vec3 c0 = matrix0.xyz, c1 = vec3(matrix0.w, matrix1.xy), c2 = vec3(matrix1.zw, matrix2.x);
  vec3 c3 = matrix2.yzw, c4 = matrix3.xyz, c5 = vec3(matrix3.w, matrix4.xy);
  vec3 c6 = vec3(matrix4.zw, matrix5.x), c7 = matrix5.yzw, c8 = matrix6.xyz;
  vec3 p = c0 + b1 * c1 + b2 * c2 + h * (c3 + b1 * c4 + b2 * c5) +
           (b1 * (b1 * c6 + b2 * c7) + b2 * b2 * c8);
  if (!(p.z > near_mm)) return;
  vec2 middle = 0.5 * cells, from = p.xy / p.z - (middle + 0.5), pixel = ceil(from);
  if (!(all(greaterThan(pixel + cells, vec2(0.0))) && all(lessThan(pixel, picture)))) return;
  vec2 d = pixel - from - middle;
  first = vec4(pixel, dot(texel_per_pixel.xy, d), dot(texel_per_pixel.zw, d));
  depth_by_offset = vec4(splat.xy, p.z, cells.x);
  vec2 guarded = picture + 2.0 * kMostSplat;
  gl_Position = vec4(2.0 * (pixel + middle + kMostSplat) / guarded - 1.0, 0.0, 1.0);
  gl_PointSize = max(cells.x, cells.y);
}
