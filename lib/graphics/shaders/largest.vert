// SPDX-License-Identifier: Apache-2.0
// Each face's largest splat, a point each on one pixel, where the largest of all stays.
uniform highp sampler2D stretches;
flat out float largest;

void main() {
  largest = texelFetch(stretches, table_at(gl_VertexID), 0).r;
  gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
  gl_PointSize = 1.0;
}
