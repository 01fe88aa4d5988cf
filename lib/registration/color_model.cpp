// SPDX-License-Identifier: GPL-3.0-or-later
#include "registration/color_model.h"

#include <array>
#include <cmath>

namespace organbake {
namespace {

constexpr int kCells = 16;  // a channel

// Calls use(cell, share) for the eight cells round a colour.
template <class Use>
void for_cells(const std::uint8_t* rgb, const Use& use) {
  std::array<int, 3> low{};
  std::array<float, 3> part{};
  for (int c = 0; c < 3; ++c) {
    const float at = static_cast<float>(rgb[c]) * (kCells - 1) / 255;
    low[c] = std::min(kCells - 2, static_cast<int>(at));
    part[c] = at - static_cast<float>(low[c]);
  }
  for (int corner = 0; corner < 8; ++corner) {
    float share = 1;
    int cell = 0;
    for (int c = 0; c < 3; ++c) {
      const int step = corner >> c & 1;
      share *= step ? part[c] : 1 - part[c];
      cell = cell * kCells + low[c] + step;
    }
    use(cell, share);
  }
}

// Of two kinds of pixels, the share of each that falls into each cell.
class ColorHistogram {
 public:
  ColorHistogram() : share_(kCells * kCells * kCells, 0) {}
  void add(const std::uint8_t* rgb, float weight) {
    for_cells(rgb, [&](int cell, float share) { share_[cell] += weight * share; });
    total_ += weight;
  }
  float density(const std::uint8_t* rgb) const {
    float sum = 0;
    for_cells(rgb, [&](int cell, float share) { sum += share * share_[cell]; });
    return total_ > 0 ? sum / total_ : 0;
  }

 private:
  std::vector<float> share_;
  float total_ = 0;
};

}  // namespace

std::vector<float> foreground_probability(const Rgb8Image& photo,
                                          const std::vector<float>& inside) {
  constexpr float kUnseen = 1e-4f;  // of the density: a colour that neither has tells nothing
  ColorHistogram organ, ground;
  for (std::size_t i = 0; i < inside.size(); ++i) {
    if (inside[i] < 0) continue;
    organ.add(&photo.pixels[3 * i], inside[i]);
    ground.add(&photo.pixels[3 * i], 1 - inside[i]);
  }
  std::vector<float> probability(inside.size());
  for (std::size_t i = 0; i < inside.size(); ++i) {
    const float f = organ.density(&photo.pixels[3 * i]) + kUnseen;
    const float b = ground.density(&photo.pixels[3 * i]) + kUnseen;
    probability[i] = f / (f + b);
  }
  return probability;
}

}  // namespace organbake
