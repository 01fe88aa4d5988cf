// SPDX-License-Identifier: Apache-2.0
// Slits of at most kWidestSlit open pixels between skin (finishing/post_process.h), one way.
uniform ivec2 back;

void finish(ivec2 at) {
  if (!is_open(shown)) return;
  int before = 0, after = 0;
  for (int k = 1; k <= kWidestSlit && before == 0; ++k)
    if (!open_at(at + k * back)) before = k;
  for (int k = 1; k <= kWidestSlit && after == 0; ++k)
    if (!open_at(at - k * back)) after = k;
  int count = before + after - 1;
  if (before == 0 || after == 0 || count > kWidestSlit) return;
  ivec2 first = at + before * back, last = at - after * back;
  if (!skin_at(first) || !skin_at(last)) return;
  ivec3 a = ivec3(color_at(first).rgb * 255.0 + 0.5), b = ivec3(color_at(last).rgb * 255.0 + 0.5);
  ivec3 mixed = (a * (count + 1 - before) + b * before + (count + 1) / 2) / (count + 1);
  shown = vec4(vec3(mixed) / 255.0, kCoverFilled / 255.0);
  gl_FragDepth = mix(depth_at(first), depth_at(last), float(before) / float(count + 1));
}
