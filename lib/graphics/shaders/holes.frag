// SPDX-License-Identifier: Apache-2.0
// An open pixel with five covered neighbours or more gets their mean (finishing/post_process.h).

void finish(ivec2 at) {
  if (!is_open(shown)) return;
  ivec3 sum = ivec3(0);
  int count = 0;
  float depth = 0.0;
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x) {
      ivec2 beside = at + ivec2(x, y);
      if (!skin_at(beside)) continue;
      sum += ivec3(color_at(beside).rgb * 255.0 + 0.5);
      depth += depth_at(beside);
      ++count;
    }
  if (count < 5) return;
  shown = vec4(vec3((sum + count / 2) / count) / 255.0, kCoverFilled / 255.0);
  gl_FragDepth = depth / float(count);
}
