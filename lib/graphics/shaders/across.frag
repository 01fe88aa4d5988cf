// SPDX-License-Identifier: Apache-2.0
// The first half of fade.frag: how much of the pixels beside this one in its row is covered.
layout(location = 0) out uint across;
uniform int fade;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  across = 0u;
  for (int d = 1 - fade; d < fade; ++d) {
    ivec2 beside = ivec2(clamp(at.x + d, 0, int(picture.x) - 1), at.y);
    if (!is_open(color_at(beside))) across += uint(fade - abs(d));
  }
}
