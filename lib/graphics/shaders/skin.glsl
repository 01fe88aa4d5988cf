// SPDX-License-Identifier: Apache-2.0
// The skin at a place of a face: by the three nodes of the base layer round it.
uniform highp usampler2D nodes;
uniform int first_knot;  // texels of the nodes' table that hold each face's knots, two a face
uniform int knots;       // of a face: three, or six
uniform highp sampler2D turns;

struct Triangle {
  ivec3 node;
  vec3 weight;
};

Triangle triangle_at(int face, float b1, float b2) {
  float n = float(steps), u = clamp(b1, 0.0, 1.0) * n, v = clamp(b2, 0.0, 1.0) * n;
  int i = min(int(u), steps - 1), j = min(int(v), steps - 1 - i);
  float along = clamp(u - float(i), 0.0, 1.0), down = clamp(v - float(j), 0.0, 1.0);
  bool beyond = along + down > 1.0, other = beyond && i + j + 2 <= steps;
  float scale = beyond ? 1.0 / (along + down) : 1.0;
  vec2 w = other ? vec2(1.0 - down, 1.0 - along) : scale * vec2(along, down);
  return Triangle(ivec3(other ? node_index(face, i + 1, j + 1) : node_index(face, i, j),
                        node_index(face, i + 1, j), node_index(face, i, j + 1)),
                  vec3(1.0 - w.x - w.y, w));
}

vec3 normal_of(uint two) {
  vec2 p = max(vec2(float(signed_low(two)), float(signed_high(two))) / 32767.0, -1.0);
  vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
  return normalize(n);
}

struct SkinAt {
  vec3 rest_normal, rest_mm, color;
  float weight;
};

// seen: whether colour and weight of the base layer are wanted.
SkinAt skin_at(int face, float b1, float b2) {
  Triangle t = triangle_at(face, b1, b2);
  SkinAt skin = SkinAt(vec3(0.0), vec3(0.0), vec3(0.0), 0.0);
  for (int k = 0; k < 3; ++k) {
    uvec4 a = texelFetch(nodes, table_at(2 * t.node[k]), 0);
    uvec4 b = texelFetch(nodes, table_at(2 * t.node[k] + 1), 0);
    vec3 root = vec3(float(a.w & 65535u), float(a.w >> 16), float(b.w)) * (kColorRoot / 65535.0);
    skin.rest_normal += t.weight[k] * normal_of(a.z);
    skin.rest_mm += t.weight[k] * uintBitsToFloat(b.xyz);
    skin.color += t.weight[k] * root * root;
    skin.weight += t.weight[k] * base_weight(a.y);
  }
  return skin;
}

mat3 turn_of(uint knot) {
  int at = 3 * int(knot);
  return mat3(texelFetch(turns, table_at(at), 0).xyz, texelFetch(turns, table_at(at + 1), 0).xyz,
              texelFetch(turns, table_at(at + 2), 0).xyz);
}

// A normal turned as lib/warp's light/normal_transport.h says; of any length.
vec3 turned(vec3 normal, int face, float b1, float b2) {
  vec3 b = vec3(1.0 - b1 - b2, b1, b2);
  uvec4 corners = texelFetch(nodes, table_at(first_knot + 2 * face), 0);
  if (knots == 3)
    return b.x * (turn_of(corners.x) * normal) + b.y * (turn_of(corners.y) * normal) +
           b.z * (turn_of(corners.z) * normal);
  uvec4 more = texelFetch(nodes, table_at(first_knot + 2 * face + 1), 0);
  vec3 w = b * (2.0 * b - 1.0), m = 4.0 * b.yzx * b.zxy;
  return w.x * (turn_of(corners.x) * normal) + w.y * (turn_of(corners.y) * normal) +
         w.z * (turn_of(corners.z) * normal) + m.x * (turn_of(corners.w) * normal) +
         m.y * (turn_of(more.x) * normal) + m.z * (turn_of(more.y) * normal);
}
