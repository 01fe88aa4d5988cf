// SPDX-License-Identifier: Apache-2.0
// What the passes share that read tables: textures whose texels lie row by row; and the view's lens.
uniform vec4 lens;  // fx, fy, cx, cy
uniform float near_mm;

ivec2 table_at(int i) { return ivec2(i & (kTableColumns - 1), i >> kTableBits); }

struct Patch {
  vec3 center, extent, along_u, along_v;
  float sine, cosine;
  int face;
};

Patch patch_of(uvec4 a, uvec4 b, uvec4 c, uvec4 d) {
  vec4 x = uintBitsToFloat(a), y = uintBitsToFloat(b), z = uintBitsToFloat(c);
  return Patch(x.xyz, vec3(x.w, y.xy), vec3(y.zw, z.x), z.yzw, uintBitsToFloat(d.x),
               uintBitsToFloat(d.y), int(d.z));
}

// Of a texel that holds two slots.
uvec2 one_of_two(uvec4 texel, int slot) { return (slot & 1) == 0 ? texel.xy : texel.zw; }

// A place of the shell, by a face's numbers or a patch's.
vec3 shell_point(mat3 plane, mat3 outward, mat3 bend, vec2 b, float h) {
  vec3 at = vec3(1.0, b);
  return plane * at + h * (outward * at) + bend * vec3(b.x * b, b.y * b.y);
}

// A word's two numbers of 16 bits, the low one first.
ivec2 signed_halves(uint word) { return ivec2(int(word << 16) >> 16, int(word) >> 16); }

// The base layer's node (i, j) of a face: its texels and its place in the face's lattice.
uniform int steps;
int node_index(int face, int i, int j) {
  return face * ((steps + 1) * (steps + 2) / 2) + i * (2 * steps + 3 - i) / 2 + j;
}

// The base layer's weight at a node, by the shares of the cameras in use that see it.
uniform ivec3 active_cameras;
uniform vec3 active_shares;
float base_weight(uint seen_by) {
  float share = 0.0;
  for (int k = 0; k < 3; ++k)
    if (active_cameras[k] < 32 && (seen_by >> active_cameras[k] & 1u) != 0u) share += active_shares[k];
  return kBaseWeight * clamp(1.0 - share / kSeenEnough, 0.0, 1.0);
}
