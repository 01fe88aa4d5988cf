// SPDX-License-Identifier: Apache-2.0
flat in float largest;
layout(location = 0) out vec4 stretch;
void main() { stretch = vec4(largest); }
