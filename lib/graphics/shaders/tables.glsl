// SPDX-License-Identifier: Apache-2.0
// Tables: textures whose texels are read row by row.
ivec2 table_at(int i) { return ivec2(i & (kTableColumns - 1), i >> kTableBits); }

struct Patch {
  vec3 center, extent, along_u, along_v;
  float sine, cosine;
  int face;
};

Patch patch_of(highp usampler2D samples, int first_patch, int number) {
  int at = first_patch + 4 * number;
  uvec4 a = texelFetch(samples, table_at(at), 0), b = texelFetch(samples, table_at(at + 1), 0);
  uvec4 c = texelFetch(samples, table_at(at + 2), 0), d = texelFetch(samples, table_at(at + 3), 0);
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

int signed_low(uint word) { return int(word << 16) >> 16; }
int signed_high(uint word) { return int(word) >> 16; }

// The base layer's node (i, j) of a face: its texels and its place in the face's lattice.
uniform int steps;
int node_index(int face, int i, int j) {
  return face * ((steps + 1) * (steps + 2) / 2) + i * (2 * steps + 3 - i) / 2 + j;
}
