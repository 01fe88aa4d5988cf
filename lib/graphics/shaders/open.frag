// SPDX-License-Identifier: Apache-2.0
// Pixels that look through the skin at what lies behind (finishing/post_process.h) become open.
uniform float texel;  // as depths are

void finish(ivec2 at) {
  float here = depth_at(at);
  if (here >= 1.0) return;
  float sides = max(min(depth_at(at + ivec2(-1, 0)), depth_at(at + ivec2(-2, 0))),
                    min(depth_at(at + ivec2(1, 0)), depth_at(at + ivec2(2, 0))));
  float ends = max(min(depth_at(at + ivec2(0, -1)), depth_at(at + ivec2(0, -2))),
                   min(depth_at(at + ivec2(0, 1)), depth_at(at + ivec2(0, 2))));
  if (min(sides, ends) < here - kStepTexels * texel) shown.a = 0.0;
}
