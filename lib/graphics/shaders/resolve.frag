// SPDX-License-Identifier: Apache-2.0
// Blends the cameras' layers and the base layer into what a pixel shows, as lib/warp's
// drawing/resolve.cpp does: a layer counts by camera share × confidence, fading out between two
// and four texels behind the nearest.
uniform highp usampler2D samples0, samples1, samples2;
uniform ivec3 first_patch, first_color;  // texels of their tables
uniform highp usampler2DArray keys;
uniform highp sampler2DArray depths;
uniform highp usampler2D base_bound;
uniform highp sampler2D base_depth;
uniform int layers;
uniform vec3 shares;
uniform ivec3 by_share;  // layers, ascending
uniform bool base_drawn;
uniform float reach, texel_mm;  // mm
layout(location = 0) out vec4 shown;

const float kNothing = 1e30;

uvec4 sample_texel(int layer, int at) {
  ivec2 place = table_at(at);
  if (layer == 0) return texelFetch(samples0, place, 0);
  if (layer == 1) return texelFetch(samples1, place, 0);
  return texelFetch(samples2, place, 0);
}

float surface_share(float depth, float nearest) {
  return clamp(2.0 - (depth - nearest) / (2.0 * texel_mm), 0.0, 1.0);
}

vec3 bytes_of(uint word) {
  return vec3(float(word & 255u), float(word >> 8 & 255u), float(word >> 16 & 255u));
}

// Colour and confidence of a layer's sample beside which a pixel looks.
vec4 color_at(int layer, int slot, vec2 offset) {
  uvec4 c = sample_texel(layer, first_color[layer] + slot);
  vec2 at = clamp(offset, -0.5, 0.5), t = at + 0.5;
  float w11 = t.x * t.y, w10 = t.x - w11, w01 = t.y - w11, w00 = 1.0 - t.x - w01;
  float own = (1.0 - 4.0 * at.x * at.x) * (1.0 - 4.0 * at.y * at.y);
  vec3 a = bytes_of(c.x), b = bytes_of(c.y), d = bytes_of(c.z), e = bytes_of(c.w);
  vec3 middle = vec3(float(c.x >> 24), float(c.y >> 24), float(c.z >> 24));
  vec3 root = w00 * a + w10 * b + w01 * d + w11 * e + own * (middle - 0.25 * (a + b + d + e));
  root = max(root, 0.0) / 255.0;
  return vec4(root * root, float(c.w >> 24) / 255.0);
}

// 255 × sRGB.
vec3 encoded(vec3 c) {
  vec3 s = sqrt(c);
  vec3 upper = -10.2279639 + s * (387.07763 + s * (-357.698542 + s * (518.053022 +
               s * (-414.034189 + s * 131.912605))));
  return min(mix(upper, 255.0 * 12.92 * c, vec3(lessThan(c, vec3(0.0031308)))), 255.0);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float behind = base_drawn ? texelFetch(base_depth, pixel, 0).r : 1.0;
  bool has_base = behind < 1.0;
  float base_mm = has_base ? behind * reach : kNothing, nearest = base_mm, nearest_sample = kNothing;
  vec3 depth_mm = vec3(kNothing);
  ivec3 slot = ivec3(0);
  vec2 offset[3];
  int leading = 0;
  for (int l = 0; l < 3; ++l) {
    offset[l] = vec2(0.0);
    if (l >= layers) continue;
    float depth = texelFetch(depths, ivec3(pixel, l), 0).r;
    if (depth >= 1.0) continue;
    uvec2 key = texelFetch(keys, ivec3(pixel, l), 0).rg;
    vec2 uv = (vec2(float(key.y & 255u), float(key.y >> 8)) - 32.0) / 31.0;
    offset[l] = kReach * uv;
    slot[l] = int(key.x);
    depth_mm[l] = max(depth * reach - kTieTexels * texel_mm * dot(uv, uv), 1e-6);
    if (depth_mm[l] < nearest_sample) nearest_sample = depth_mm[l], leading = l;
  }
  nearest = min(nearest, nearest_sample);
  if (nearest >= kNothing) discard;
  for (int k = 0; k < layers; ++k)
    if (depth_mm[by_share[k]] <= nearest + 2.0 * texel_mm) leading = by_share[k];

  vec3 color = vec3(0.0);
  float weight = 0.0;
  for (int l = 0; l < layers; ++l) {
    if (depth_mm[l] >= kNothing) continue;
    vec4 one = color_at(l, slot[l], offset[l]);
    float w = shares[l] * one.a * surface_share(depth_mm[l], nearest);
    color += w * one.rgb;
    weight += w;
  }
  if (weight > 0.0 && light != 0) {
    uvec2 place = one_of_two(sample_texel(leading, slot[leading] >> 1), slot[leading]);
    int at = first_patch[leading] + 4 * (slot[leading] / kSlots);
    Patch p = patch_of(sample_texel(leading, at), sample_texel(leading, at + 1),
                       sample_texel(leading, at + 2), sample_texel(leading, at + 3));
    vec2 b = p.center.xy + p.extent.xy / kFullCoordinate * vec2(signed_halves(place.x));
    if (light == 2) b += offset[leading].x * p.along_u.xy + offset[leading].y * p.along_v.xy;
    color = lit(color, weight, nearest, skin_at(p.face, b));
  }
  if (has_base) {
    uvec2 bound = texelFetch(base_bound, pixel, 0).rg;
    vec2 b = vec2(float(bound.y & 65535u), float(bound.y >> 16)) / 65535.0;
    SkinAt skin = skin_at(int(bound.x), b);
    float w = max(skin.weight, 1e-6) * surface_share(base_mm, nearest);
    color += w * lit(skin.color, 1.0, base_mm, skin);
    weight += w;
  }
  if (!(weight > 0.0)) discard;
  float cover = nearest_sample < kNothing ? kCoverSamples : kCoverBase;
  shown = vec4(floor(encoded(color / weight) + 0.5) / 255.0, cover / 255.0);
  gl_FragDepth = min(nearest / reach, 0.9999999);
}
