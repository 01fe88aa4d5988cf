// SPDX-License-Identifier: Apache-2.0
// Skin fades into the background beside where it ends: finishing/post_process.h.
uniform highp usampler2D across;
uniform int fade;
uniform vec3 background;

void finish(ivec2 at) {
  if (is_open(shown)) return;
  int sum = 0, all = fade * fade * fade * fade;
  for (int d = 1 - fade; d < fade; ++d) {
    ivec2 beside = ivec2(at.x, clamp(at.y + d, 0, int(picture.y) - 1));
    sum += (fade - abs(d)) * int(texelFetch(across, beside, 0).r);
  }
  if (sum == all) return;
  float t = max(0.0, float(2 * sum - all) / float(all));
  vec3 light = mix(linear_of(background), linear_of(shown.rgb), t * t * (3.0 - 2.0 * t));
  shown.rgb = floor(srgb_of(light) * 255.0 + 0.5) / 255.0;
}
