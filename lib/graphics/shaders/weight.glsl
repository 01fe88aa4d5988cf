// SPDX-License-Identifier: Apache-2.0
// The base layer's weight at a node, by the shares of the cameras in use that see it.
uniform ivec3 active_cameras;
uniform vec3 active_shares;
float base_weight(uint seen_by) {
  float share = 0.0;
  for (int k = 0; k < 3; ++k)
    if (active_cameras[k] < 32 && (seen_by >> active_cameras[k] & 1u) != 0u) share += active_shares[k];
  return kBaseWeight * clamp(1.0 - share / kSeenEnough, 0.0, 1.0);
}
