// SPDX-License-Identifier: Apache-2.0
// A face of the shell in the view's frame, mm: see shell_point().
uniform highp sampler2D shells;
uniform mat3 rotation;  // of the view from the organ's frame
uniform vec3 translation;
uniform float texel_mm;

struct Shell {
  mat3 plane, outward, bend;
  bool two_sided;
};

Shell shell_of(int face) {
  vec4 t[7];
  for (int k = 0; k < 7; ++k) t[k] = texelFetch(shells, table_at(7 * face + k), 0);
  Shell s = Shell(rotation * mat3(t[0], t[1], t[2].x), rotation * mat3(t[2].yzw, t[3], t[4].xy),
                  rotation * mat3(t[4].zw, t[5], t[6].xyz), t[6].w != 0.0);
  s.plane[0] += translation;
  return s;
}

// Seen from near: placing/placing.h.
bool is_near(Shell s) {
  return s.plane[0].z + min(0.0, min(s.plane[1].z, s.plane[2].z)) <= lens.x * texel_mm / kNearTexel_px;
}

// To pixels × depth, and depth.
mat3 projection() { return mat3(lens.x, 0.0, 0.0, 0.0, lens.y, 0.0, lens.zw, 1.0); }
