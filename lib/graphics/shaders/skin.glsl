// SPDX-License-Identifier: Apache-2.0
// The skin at a place of a face: by the three nodes of the base layer round it, as lib/warp's
// light/relit_pixels.cpp finds them. Beyond the face's edge light stays as it is there, and places at
// rest go on.
uniform highp usampler2D nodes;
uniform int first_knot;  // texels of the nodes' table that hold each face's knots, two a face
uniform int knots;       // of a face: three, or six
uniform highp sampler2D turns;

vec3 normal_of(uint two) {
  vec2 p = max(vec2(signed_halves(two)) / 32767.0, -1.0);
  vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
  return normalize(n);
}

struct SkinAt {
  int face;
  vec2 nearest;
  vec3 rest_normal, rest_mm, color;
  float weight, bend;
};

SkinAt skin_at(int face, vec2 place) {
  vec2 cells = place * float(steps);
  int i = clamp(int(cells.x), 0, steps - 1), j = clamp(int(cells.y), 0, steps - 1 - i);
  vec2 first = vec2(ivec2(i, j)), far = clamp(cells - first, -1.0, 2.0), near = clamp(far, 0.0, 1.0);
  bool other = far.x + far.y > 1.0 && i + j + 2 <= steps;
  if (!other) near -= 0.5 * max(near.x + near.y - 1.0, 0.0);
  vec2 w = other ? 1.0 - near.yx : near, more = other ? vec2(0.0) : far - near;
  // At the nearest place of the face; of what goes on.
  vec3 weight = vec3(1.0 - w.x - w.y, w), of_place = weight + vec3(-more.x - more.y, more);
  ivec3 node = ivec3(other ? node_index(face, i + 1, j + 1) : node_index(face, i, j),
                     node_index(face, i + 1, j), node_index(face, i, j + 1));
  SkinAt skin = SkinAt(face, (first + near) / float(steps), vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0);
  for (int k = 0; k < 3; ++k) {
    uvec4 a = texelFetch(nodes, table_at(2 * node[k]), 0);
    uvec4 b = texelFetch(nodes, table_at(2 * node[k] + 1), 0);
    vec3 root = vec3(float(a.w & 65535u), float(a.w >> 16), float(b.w & 65535u)) * (kColorRoot / 65535.0);
    skin.rest_normal += weight[k] * normal_of(a.z);
    skin.rest_mm += of_place[k] * uintBitsToFloat(b.xyz);
    skin.color += weight[k] * root * root;
    skin.bend += weight[k] * float(b.w >> 16) * (kSharpestBend / 65535.0);
    skin.weight += weight[k] * base_weight(a.y);
  }
  return skin;
}

mat3x4 turn_of(uint knot) {
  int at = 3 * int(knot);
  return mat3x4(texelFetch(turns, table_at(at), 0), texelFetch(turns, table_at(at + 1), 0),
                texelFetch(turns, table_at(at + 2), 0));
}

// How normals turn there, as lib/warp's light/relit_skin.h says.
mat3x4 turn_at(SkinAt skin) {
  vec3 b = vec3(1.0 - skin.nearest.x - skin.nearest.y, skin.nearest);
  int face = skin.face;
  uvec4 corners = texelFetch(nodes, table_at(first_knot + 2 * face), 0);
  if (knots == 3)
    return b.x * turn_of(corners.x) + b.y * turn_of(corners.y) + b.z * turn_of(corners.z);
  uvec4 more = texelFetch(nodes, table_at(first_knot + 2 * face + 1), 0);
  vec3 w = b * (2.0 * b - 1.0), m = 4.0 * b.yzx * b.zxy;
  return w.x * turn_of(corners.x) + w.y * turn_of(corners.y) + w.z * turn_of(corners.z) +
         m.x * turn_of(corners.w) + m.y * turn_of(more.x) + m.z * turn_of(more.y);
}
