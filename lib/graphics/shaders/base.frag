// SPDX-License-Identifier: Apache-2.0
in vec3 place;
flat in uint face_at;
flat in int weighs, sides;
uniform highp sampler2DArray depths;
uniform int layers;
uniform float inverse_reach;
layout(location = 0) out uvec2 bound;

void main() {
  // Rows run down: what faces the eye is wound the other way round.
  if (gl_FrontFacing && sides == 1) discard;
  if (weighs == 0)
    for (int k = 0; k < layers; ++k)
      if (texelFetch(depths, ivec3(ivec2(gl_FragCoord.xy), k), 0).r < 1.0) discard;
  gl_FragDepth = max(place.z, 1e-6) * inverse_reach;
  uvec2 b = uvec2(clamp(place.xy, 0.0, 1.0) * 65535.0 + 0.5);
  bound = uvec2(face_at, b.x | b.y << 16);
}
