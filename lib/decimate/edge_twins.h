// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace organbake {

inline constexpr std::uint32_t kNoTwin = 0xFFFFFFFFu;

// Half-edge h = 3·face + corner runs from that corner to the next one of its face.
inline std::uint32_t next_in_face(std::uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
inline std::uint32_t previous_in_face(std::uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }

// The half-edge on the other side of each, kNoTwin at a border. Nothing when the faces are not a
// consistently wound manifold in which every vertex has one fan: several times faster than
// counting what is wrong, for the usual case that nothing is.
std::optional<std::vector<std::uint32_t>> edge_twins(const std::vector<Face>& faces,
                                                     std::size_t vertices);

}  // namespace organbake
