// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "organbake/image/channel_image.h"

namespace organbake {

// A photograph of the tissue that a surface without colours shall get.
struct ExemplarPhoto {
  Rgb8Image image;
  std::vector<std::uint8_t> mask;  // of the image's size, 0 where it is not that tissue; empty: all
  double mm_per_pixel = 0;         // on the tissue, 0.001…10
};

// A tissue that a photograph shows: of its mask's pixels that are neither dark nor white.
struct ShownTissue {
  double share = 0;
  Eigen::Vector3f color = Eigen::Vector3f::Zero();  // the mean, linear
};
// The largest first; more than one where red over green differs as between a liver and fat, over a
// twentieth of the pixels or more. Tissues of like hue are not told apart.
std::vector<ShownTissue> tissues_shown(const ExemplarPhoto& photo);

// The photograph's tissue without its light and its highlights, as what histogram-preserving
// blending needs (Heitz and Neyret 2018): along each axis of its colours' principal components the
// values are ranked and replaced by those of a normal distribution, whose blends keep their
// variance when divided by ‖weights‖; a table brings what was blended back.
class Exemplar {
 public:
  // Throws UsageError for the scale, BadDataError for a mask of another size or for a photograph
  // with less tissue than kLeastTissue_px in one piece: all highlight, black, too small.
  explicit Exemplar(const ExemplarPhoto& photo);

  // Squares of tissue are cut out round these places, at most `reach_mm` to each side.
  double reach_mm() const { return reach_px_ * mm_per_pixel_; }
  std::size_t place_count() const { return places_.size(); }
  // The normal scores there, interpolated; from_place_mm within ± reach_mm.
  Eigen::Vector3f scores(std::size_t place, const Eigen::Vector2d& from_place_mm) const;
  // Of blended scores: linear colour, ≥ 0.
  Eigen::Vector3f color(const Eigen::Vector3f& scores) const;

  // What the tissue's pixels are without light, before any blending; for measuring.
  const std::vector<Eigen::Vector3f>& tissue() const { return tissue_; }
  double highlight_share() const { return highlight_share_; }  // of the mask's pixels

  static constexpr int kLeastTissue_px = 1024;

 private:
  void keep(const ExemplarPhoto& photo, std::vector<std::uint8_t>& usable);
  void take_light_out(const std::vector<std::uint8_t>& usable);
  void find_places(const std::vector<std::uint8_t>& usable);
  void make_scores(const std::vector<std::uint8_t>& usable);

  static constexpr int kTable = 512;

  int width_ = 0, height_ = 0;
  double mm_per_pixel_ = 1, reach_px_ = 0, highlight_share_ = 0;
  std::vector<Eigen::Vector3f> pixels_;  // colours at first, then scores
  std::vector<Eigen::Vector3f> tissue_;
  std::vector<std::array<int, 2>> places_;  // x, y
  Eigen::Vector3f mean_ = Eigen::Vector3f::Zero();
  Eigen::Matrix3f axes_ = Eigen::Matrix3f::Identity();
  std::array<std::array<float, kTable + 1>, 3> table_{};  // by score, −kWidest…kWidest
};

}  // namespace organbake
