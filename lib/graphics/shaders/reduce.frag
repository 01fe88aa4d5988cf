// SPDX-License-Identifier: Apache-2.0
// The largest of a block of kReduce² texels.
uniform highp sampler2D stretches;
layout(location = 0) out vec4 largest;
void main() {
  ivec2 size = textureSize(stretches, 0), first = ivec2(gl_FragCoord.xy) * kReduce;
  ivec2 last = min(first + kReduce, size);
  largest = vec4(0.0);
  for (int y = first.y; y < last.y; ++y)
    for (int x = first.x; x < last.x; ++x)
      largest = max(largest, texelFetch(stretches, ivec2(x, y), 0));
}
