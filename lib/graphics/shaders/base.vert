// SPDX-License-Identifier: Apache-2.0
// The base layer's lattice: triangle after triangle of face after face, as lib/warp's
// drawing/base_drawing.cpp draws it.
uniform highp usampler2D nodes;
uniform bool cut;
uniform vec2 picture;

out vec3 place;  // b1, b2, depth
flat out uint face_at;
flat out int weighs, sides;

void main() {
  int triangle = gl_VertexID / 3, corner = gl_VertexID - 3 * triangle;
  int face = triangle / (steps * steps), number = triangle - face * steps * steps;
  // Rows of 2 (n − i) − 1: n² − number lies between two squares.
  int rest = int(ceil(sqrt(float(steps * steps - number)) - 0.001)), i = steps - rest;
  int in_row = number - (steps * steps - rest * rest), j = in_row >> 1;
  bool other = (in_row & 1) != 0;
  ivec2 at[3];
  at[0] = other ? ivec2(i + 1, j) : ivec2(i, j);
  at[1] = other ? ivec2(i + 1, j + 1) : ivec2(i + 1, j);
  at[2] = ivec2(i, j + 1);
  float weight = 0.0;
  uvec4 node = uvec4(0u);
  ivec2 own = at[0];
  for (int k = 0; k < 3; ++k) {
    uvec4 one = texelFetch(nodes, table_at(2 * node_index(face, at[k].x, at[k].y)), 0);
    weight = max(weight, base_weight(one.y));
    if (k == corner) node = one, own = at[k];
  }
  Shell s = shell_of(face);
  weighs = is_near(s) || weight > 0.0 ? 1 : 0;
  face_at = uint(face), place = vec3(0.0), sides = 1;
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  if (weighs == 0 && !s.two_sided && !cut) return;
  sides = s.two_sided ? 2 : 1;
  vec2 b = vec2(own) / float(steps);
  vec3 p = shell_point(s.plane, s.outward, s.bend, b, uintBitsToFloat(node.x));
  place = vec3(b, p.z);
  vec3 pixel = projection() * p;
  gl_Position = vec4(2.0 * pixel.xy / picture - p.z, p.z - 2.0 * near_mm, p.z);
}
