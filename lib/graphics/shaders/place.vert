// SPDX-License-Identifier: Apache-2.0
// Places one patch of samples, as lib/warp's placing/patch_frames.cpp and drawing/splat.cpp do:
// what its samples land by is captured for splat.vert, and nothing drawn.
uniform highp usampler2D samples;
uniform int first_patch;
uniform vec2 picture;  // its size

// The face's for this patch, in pixels: from its samples' coordinates instead of b1, b2 and h.
out mat3 plane, outward, bend;
out vec4 texel_per_pixel;  // offset by pixel: u_x, u_y, v_x, v_y
out vec4 splat;            // depth by offset: z_u, z_v; columns and rows, 0: not drawn

// Pixels along one axis that a box of camera space can reach, grown by half a splat.
vec2 interval(float center, float extent, float z0, float z1, float focal, float middle,
              float pixels) {
  float grow = 0.5 * pixels + 1.0, from = center - extent, to = center + extent;
  return vec2(middle + focal * (from / (from < 0.0 ? z0 : z1)) - grow,
              middle + focal * (to / (to > 0.0 ? z0 : z1)) + grow + 1.0);
}

bool faces_away(vec3 center, vec3 extent, float turn, vec3 normal, float sine, float cosine) {
  float along = dot(normal, center), distance2 = dot(center, center);
  float radius = length(extent) + (turn > 0.0 ? turn * sqrt(distance2) : 0.0);
  float tangent2 = distance2 - radius * radius, tangent = sqrt(max(tangent2, 0.0));
  float wide_sine = sine * tangent + cosine * radius;
  float wide_cosine = cosine * tangent - sine * radius;
  return along > 0.0 && tangent2 > 0.0 && wide_cosine > 0.0 &&
         along > wide_sine * length(normal);
}

void main() {
  uvec4 texels[4];
  for (int k = 0; k < 4; ++k)
    texels[k] = texelFetch(samples, table_at(first_patch + 4 * gl_VertexID + k), 0);
  Patch p = patch_of(texels[0], texels[1], texels[2], texels[3]);
  Shell s = shell_of(p.face);
  vec2 b = p.center.xy;
  float h = p.center.z;
  vec3 e = p.extent, aside1 = s.outward[1], aside2 = s.outward[2];
  vec3 of_11 = s.bend[0], of_12 = s.bend[1], of_22 = s.bend[2];
  vec3 more1 = 2.0 * b.x * of_11 + b.y * of_12, more2 = b.x * of_12 + 2.0 * b.y * of_22;
  vec3 flat1 = s.plane[1] + aside1 * h, flat2 = s.plane[2] + aside2 * h;
  vec3 by_b1 = flat1 + more1, by_b2 = flat2 + more2, by_h = s.outward * vec3(1.0, b);
  vec3 center = shell_point(s.plane, s.outward, s.bend, b, h);
  vec3 extent = abs(flat1) * e.x + abs(flat2) * e.y + abs(by_h) * e.z +
                (abs(aside1) * e.x + abs(aside2) * e.y) * e.z + abs(more1) * e.x + abs(more2) * e.y +
                abs(of_11) * (e.x * e.x) + abs(of_12) * (e.x * e.y) + abs(of_22) * (e.y * e.y);
  float turn = length(abs(of_11) * (2.0 * e.x) + abs(of_12) * e.y) / max(length(by_b1), 1e-30) +
               length(abs(of_12) * e.x + abs(of_22) * (2.0 * e.y)) / max(length(by_b2), 1e-30);
  vec3 s_u = by_b1 * p.along_u.x + by_b2 * p.along_u.y + by_h * p.along_u.z;
  vec3 s_v = by_b1 * p.along_v.x + by_b2 * p.along_v.y + by_h * p.along_v.z;

  float inverse_z = 1.0 / max(center.z, near_mm);
  vec2 focal = lens.xy * inverse_z, at = center.xy * inverse_z;
  vec2 by_u = focal * (s_u.xy - at * s_u.z), by_v = focal * (s_v.xy - at * s_v.z);
  vec2 largest2 = max(abs(by_u), abs(by_v));
  float size = max(max(largest2.x, largest2.y), 0.02);
  float exact = by_u.x * by_v.y - by_v.x * by_u.y, least = 1e-3 * size * size;
  float determinant = abs(exact) < least ? (exact < 0.0 ? -least : least) : exact;
  texel_per_pixel = vec4(by_v.y, -by_v.x, -by_u.y, by_u.x) / (determinant * kReach);
  vec2 cells = clamp(ceil(abs(by_u) + abs(by_v)), 1.0, float(kMostSplat));

  float z0 = max(center.z - extent.z, near_mm), z1 = center.z + extent.z;
  vec2 x = interval(center.x, extent.x, z0, z1, lens.x, lens.z, cells.x);
  vec2 y = interval(center.y, extent.y, z0, z1, lens.y, lens.w, cells.y);
  bool seen = z1 >= near_mm && floor(clamp(x.y, 0.0, picture.x)) > floor(clamp(x.x, 0.0, picture.x)) &&
              floor(clamp(y.y, 0.0, picture.y)) > floor(clamp(y.x, 0.0, picture.y));
  vec3 normal = cross(s_v, s_u);
  if (!s.two_sided && faces_away(center, extent, turn, normal, p.sine, p.cosine)) seen = false;
  bool left_to_base = !s.two_sided && dot(normal, center) > 0.0 && is_near(s);
  splat = vec4(kReach * s_u.z, kReach * s_v.z, seen && !left_to_base ? cells : vec2(0.0));

  vec3 f = e / kFullCoordinate;
  plane = projection() * mat3(center, by_b1 * f.x, by_b2 * f.y);
  outward = projection() * mat3(by_h, aside1 * f.x, aside2 * f.y) * f.z;
  bend = projection() * mat3(of_11 * (f.x * f.x), of_12 * (f.x * f.y), of_22 * (f.y * f.y));
  gl_Position = vec4(0.0);
}
