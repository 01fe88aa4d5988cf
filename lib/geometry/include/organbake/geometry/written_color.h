// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace organbake {

// How a file's colours are written. `number`: 0…1 if none exceeds 1, else 0…255, else 0…65535.
enum class ColorScale { linear, number, byte, two_bytes };

// Scene-linear colours of those that a file holds; all but linear ones are sRGB (IEC 61966-2-1).
std::vector<Eigen::Vector3f> linear_colors(const std::vector<Eigen::Vector3d>& written,
                                           ColorScale scale);

// The colour of each of `vertex_count` vertices: the mean of its faces'; black without a face.
std::vector<Eigen::Vector3f> vertex_from_face_colors(
    const std::vector<std::array<std::uint32_t, 3>>& faces,
    const std::vector<Eigen::Vector3f>& face_colors, std::size_t vertex_count);

}  // namespace organbake
