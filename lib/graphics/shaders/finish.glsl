// SPDX-License-Identifier: Apache-2.0
// What the finishing passes share: a picture whose alpha tells what each pixel shows (Cover), and
// the depth of its skin. Those that change the picture have a finish(), called by pass.glsl.
uniform highp sampler2D colors, depths;
uniform vec2 picture;

bool within(ivec2 at) { return all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, ivec2(picture))); }
vec4 color_at(ivec2 at) { return texelFetch(colors, at, 0); }
float depth_at(ivec2 at) { return within(at) ? texelFetch(depths, at, 0).r : 1.0; }
bool is_open(vec4 color) { return color.a < 0.5 / 255.0; }
// Within the picture.
bool open_at(ivec2 at) { return within(at) && is_open(color_at(at)); }
bool skin_at(ivec2 at) {
  if (!within(at)) return false;
  float a = color_at(at).a * 255.0;
  return a > 0.5 && a < kCoverSolid - 0.5;
}

vec3 linear_of(vec3 c) {
  return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, vec3(lessThanEqual(c, vec3(0.04045))));
}
vec3 srgb_of(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, vec3(lessThanEqual(c, vec3(0.0031308))));
}
