// SPDX-License-Identifier: Apache-2.0
// A face of the shell in the view's frame, mm: S = m · (1, b1, b2, h, h·b1, h·b2, b1², b1·b2, b2²).
uniform highp sampler2D shells;
uniform mat3 rotation;  // of the view from the organ's frame
uniform vec3 translation;
uniform vec4 lens;  // fx, fy, cx, cy
uniform float texel_mm;

struct Shell {
  vec3 m[9];
  bool two_sided;
};

Shell shell_of(int face) {
  vec4 t[7];
  for (int k = 0; k < 7; ++k) t[k] = texelFetch(shells, table_at(7 * face + k), 0);
  Shell s;
  s.m[0] = rotation * t[0].xyz + translation;
  s.m[1] = rotation * vec3(t[0].w, t[1].xy);
  s.m[2] = rotation * vec3(t[1].zw, t[2].x);
  s.m[3] = rotation * t[2].yzw;
  s.m[4] = rotation * t[3].xyz;
  s.m[5] = rotation * vec3(t[3].w, t[4].xy);
  s.m[6] = rotation * vec3(t[4].zw, t[5].x);
  s.m[7] = rotation * t[5].yzw;
  s.m[8] = rotation * t[6].xyz;
  s.two_sided = t[6].w != 0.0;
  return s;
}

// Seen from near: placing/placing.h.
bool is_near(Shell s) {
  return s.m[0].z + min(0.0, min(s.m[1].z, s.m[2].z)) <= lens.x * texel_mm / kNearTexel;
}

// Pixels × depth, and depth.
vec3 projected(vec3 p) { return vec3(lens.xy * p.xy + lens.zw * p.z, p.z); }
