// SPDX-License-Identifier: Apache-2.0
#include "samples/lip_film.h"

#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

std::uint8_t dimmed(std::uint32_t value, double kept) {
  return static_cast<std::uint8_t>(std::lround(kept * value));
}

// The parabola of a texel's brightness through its neighbours' along one axis, once a film leaves
// of the three these shares.
void dim_terms(double brightness, double before, double here, double after, std::int8_t& along,
               std::int8_t& curve) {
  const double last = (brightness - along + curve) * before,
               next = (brightness + along + curve) * after;
  const auto to_int8 = [](double v) {
    return static_cast<std::int8_t>(std::lround(std::clamp(v, -127.0, 127.0)));
  };
  along = to_int8((next - last) / 2);
  curve = to_int8((next + last) / 2 - brightness * here);
}

// The film on the texels of one patch.
class PatchFilm {
 public:
  PatchFilm(const TriangleMesh& skin, const Patch& patch, double texel_mm,
            const std::vector<WetRim::Lip>& lips)
      : texel_mm_(texel_mm) {
    const Face& corners = skin.faces[patch.face];
    origin_mm_ = skin.vertices[corners[0]];
    for (int k = 0; k < 2; ++k) sides_mm_.col(k) = skin.vertices[corners[k + 1]] - origin_mm_;
    along_u_mm_ = sides_mm_ * Eigen::Vector2d(patch.along_u[0], patch.along_u[1]);
    along_v_mm_ = sides_mm_ * Eigen::Vector2d(patch.along_v[0], patch.along_v[1]);
    const double radius_mm = sides_mm_.col(0).norm() * patch.extent[0] +
                             sides_mm_.col(1).norm() * patch.extent[1] + along_u_mm_.norm() +
                             along_v_mm_.norm();
    lips_ = WetRim::near(lips, place_mm({patch.center[0], patch.center[1]}),
                         radius_mm + WetRim::reach_mm(texel_mm));
  }
  bool none() const { return lips_.empty(); }

  // Each texel is dimmed by what lies on its middle, its neighbours and its corners: texels that
  // are dark as a whole would show as steps. at: b1, b2.
  void cover(const Eigen::Vector2d& at, PackedDetail& detail) const {
    const Eigen::Vector3d middle_mm = place_mm(at);
    const Eigen::Array3d kept = kept_at(middle_mm, 0, 0);
    const auto mean_at = [&](int u, int v) { return kept_at(middle_mm, u, v).mean(); };
    auto texel = __builtin_bit_cast(TexelDetail, detail);
    const double brightness = (texel.red + texel.green + texel.blue) / 3.0;
    dim_terms(brightness, mean_at(-1, 0), kept.mean(), mean_at(1, 0), texel.along_u, texel.curve_u);
    dim_terms(brightness, mean_at(0, -1), kept.mean(), mean_at(0, 1), texel.along_v, texel.curve_v);
    texel.red = dimmed(texel.red, kept[0]);
    texel.green = dimmed(texel.green, kept[1]);
    texel.blue = dimmed(texel.blue, kept[2]);
    detail = __builtin_bit_cast(PackedDetail, texel);
  }
  void cover(const Eigen::Vector2d& at, SmoothDetail& smooth) const {
    const Eigen::Vector3d middle_mm = place_mm(at);
    const Eigen::Array3d in_middle = kept_at(middle_mm, 0, 0);
    for (int k = 0; k < 4; ++k) {
      const Eigen::Array3d at_corner = kept_at(middle_mm, k % 2 - 0.5, k / 2 - 0.5);
      std::uint32_t middle = smooth[k] >> 24, corner = 0;
      if (k < 3) middle = dimmed(middle, in_middle[k]);
      for (int c = 0; c < 3; ++c)
        corner |= std::uint32_t{dimmed(smooth[k] >> (8 * c) & 255u, at_corner[c])} << (8 * c);
      smooth[k] = corner | middle << 24;
    }
  }

 private:
  Eigen::Vector3d place_mm(const Eigen::Vector2d& at) const { return origin_mm_ + sides_mm_ * at; }
  // Of square-root light.
  Eigen::Array3d kept_at(const Eigen::Vector3d& middle_mm, double texels_u, double texels_v) const {
    const Eigen::Vector3d there_mm = middle_mm + texels_u * along_u_mm_ + texels_v * along_v_mm_;
    return WetRim::kept(WetRim::share(lips_, there_mm, texel_mm_)).sqrt();
  }

  double texel_mm_;
  std::vector<WetRim::Lip> lips_;
  Eigen::Vector3d origin_mm_;
  Eigen::Matrix<double, 3, 2> sides_mm_;
  Eigen::Vector3d along_u_mm_, along_v_mm_;  // of a texel
};

}  // namespace

void wet_samples(const TriangleMesh& skin, const WetRim& rim, SampleSet& samples) {
  for (std::uint32_t c = 0; c < samples.chunks.size(); ++c) {
    const Chunk& chunk = samples.chunks[c];
    const std::vector<WetRim::Lip>& lips = rim.lips()[chunk.patch.face];
    if (lips.empty()) continue;
    const PatchFilm film(skin, chunk.patch, samples.texel_mm, lips);
    if (film.none()) continue;
    for (std::size_t slot = std::size_t{c} * kChunk, i = 0; i < chunk.count; ++i, ++slot) {
      const std::array<float, 3> bound = samples.bound(slot);
      const Eigen::Vector2d at(bound[0], bound[1]);
      film.cover(at, samples.detail[slot]);
      if (!samples.smooth.empty()) film.cover(at, samples.smooth[slot]);
    }
  }
}

}  // namespace organbake
