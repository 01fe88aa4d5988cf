// SPDX-License-Identifier: Apache-2.0
#include "warp/outline.h"

#include <algorithm>
#include <cmath>

#include "image/srgb.h"

namespace organbake {
namespace {

using Linear = std::array<float, 3>;

constexpr double kSteps = 254;  // of a pixel's share; half a pixel is the most that changes

Linear linear_color(const std::uint8_t* rgb) {
  const auto& table = linear_from_srgb8();
  return {table[rgb[0]], table[rgb[1]], table[rgb[2]]};
}

}  // namespace

// Skin beside background, from one pair of pixels on to the right or down.
struct Outline::Border {
  PixelAt first;    // of the pixels on the left or upper side
  bool to_right;    // the border runs along a row; else down a column
  bool skin_first;  // skin is on the left or upper side

  PixelAt near(int i) const {
    return to_right ? PixelAt{first.x + i, first.y} : PixelAt{first.x, first.y + i};
  }
  PixelAt far(int i) const {
    const PixelAt side = near(i);
    return to_right ? PixelAt{side.x, side.y + 1} : PixelAt{side.x + 1, side.y};
  }
  PixelAt skin(int i) const { return skin_first ? near(i) : far(i); }
  PixelAt open(int i) const { return skin_first ? far(i) : near(i); }
};

void Outline::change(PixelAt pixel, double share) {
  const int steps = static_cast<int>(kSteps * share);
  if (steps == 0) return;
  const auto at = static_cast<std::uint32_t>(pixel.y * width_ + pixel.x);
  // Aslant, a border has stretches both ways: the longer ones tell more.
  if (std::abs(steps) <= std::abs(int{change_[at]})) return;
  if (change_[at] == 0) softened_.push_back({at, {}});
  change_[at] = static_cast<std::int8_t>(steps);
}

// How far the outline of a stretch rises whose ends both step to one side, by the stretches that
// the border goes on with.
double Outline::rise_of(const Border& border, int length, BorderStep ends) const {
  Border next = border;
  (border.to_right ? next.first.y : next.first.x) += border.skin_first ? ends : -ends;
  const auto count = [&](int first, int direction) {
    int n = 0;
    while (is_border(next, first + direction * n)) ++n;
    return n;
  };
  double sum = 0;
  int sides = 0;
  for (const int n : {count(-1, -1), count(length, 1)}) {
    if (n == 0) continue;
    // Of the parabola through the ends of both.
    sum += 0.25 * length * length / (double(n) * (n + length));
    ++sides;
  }
  // A pixel's rise would reach the next pixels' centres; of bumps that follow on each other many
  // would.
  constexpr double kMost = 0.75, kUnknown = 0.5;
  return sides > 0 ? std::min(sum / sides, kMost) : kUnknown;
}

bool Outline::is_border(const Border& border, int i) const {
  return bits_->is_skin(border.skin(i)) && bits_->is_open(border.open(i));
}

// A stretch without a step, from its first pixel on.
void Outline::follow(const Border& border) {
  int length = 1;
  while (is_border(border, length)) ++length;
  const auto step = [&](int i) {
    const PixelAt near = border.near(i), far = border.far(i);
    return static_cast<BorderStep>(int{bits_->is_skin(near) && bits_->is_skin(far)} -
                                   int{bits_->is_open(near) && bits_->is_open(far)});
  };
  const BorderStep before = step(-1), after = step(length);
  if (before == no_step && after == no_step) return;
  const bool bow = before == after;
  const double rise = bow ? rise_of(border, length, before) : 0;
  for (int i = 0; i < length; ++i) {
    const OutlineAreas areas =
        bow ? areas_of_bow(length, before, rise, i) : areas_of_slope(length, before, after, i);
    change(border.open(i), areas.of_open);
    change(border.skin(i), -areas.of_skin);
  }
}

void Outline::follow_rows() {
  const PixelBox& box = bits_->box();
  for (int y = box.y0; y + 1 < box.y1; ++y) {
    for (const bool skin_first : {true, false}) {
      const std::uint64_t* skin = bits_->skin(skin_first ? y : y + 1);
      const std::uint64_t* open = bits_->open(skin_first ? y + 1 : y);
      std::uint64_t last = 0;  // bit of the word before
      for (int word = 0; word < bits_->words(); ++word) {
        const std::uint64_t border = skin[word] & open[word];
        bits_->for_each(border & ~(border << 1 | last), word, y, [&](PixelAt first) {
          follow({first, true, skin_first});
        });
        last = border >> (SkinBits::kWord - 1);
      }
    }
  }
}

void Outline::follow_columns() {
  const PixelBox& box = bits_->box();
  std::vector<std::uint64_t> above;
  for (const bool skin_first : {true, false}) {
    above.assign(bits_->words(), 0);
    for (int y = box.y0; y < box.y1; ++y) {
      const std::uint64_t* near = skin_first ? bits_->skin(y) : bits_->open(y);
      const std::uint64_t* far = skin_first ? bits_->open(y) : bits_->skin(y);
      for (int word = 0; word < bits_->words(); ++word) {
        const std::uint64_t border = near[word] & bits_->left_of(far, word);
        bits_->for_each(border & ~above[word], word, y, [&](PixelAt first) {
          follow({first, false, skin_first});
        });
        above[word] = border;
      }
    }
  }
}

void Outline::blend(const Pixel& pixel, const Linear& background, Frame& frame) const {
  const PixelAt at{static_cast<int>(pixel.at) % width_, static_cast<int>(pixel.at) / width_};
  Linear color{};
  double share = change_[pixel.at] / kSteps;
  if (share < 0) {
    share += 1;
    color = linear_color(pixel.color.data());
  } else {
    int count = 0;
    for (const auto [dx, dy] : {std::array{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
      const PixelAt beside{at.x + dx, at.y + dy};
      if (!bits_->is_skin(beside)) continue;
      const Linear skin = linear_color(frame.color.at(beside.x, beside.y));
      for (int c = 0; c < 3; ++c) color[c] += skin[c];
      ++count;
    }
    for (float& c : color) c /= static_cast<float>(count);
  }
  for (int c = 0; c < 3; ++c) {
    const auto mixed = static_cast<float>(share * color[c] + (1 - share) * background[c]);
    frame.color.at(at.x, at.y)[c] = srgb8_from_linear(mixed);
  }
}

void Outline::soften(const PixelBox& drawn, const std::array<std::uint8_t, 3>& background,
                     Frame& frame) {
  SkinBits skin;
  skin.read_with_border(drawn, frame);
  soften(skin, background, frame);
}

void Outline::soften(const SkinBits& skin, const std::array<std::uint8_t, 3>& background,
                     Frame& frame) {
  softened_.clear();
  if (skin.box().empty()) return;
  width_ = frame.color.width;
  change_.resize(frame.cover.size());
  bits_ = &skin;
  follow_rows();
  follow_columns();
  for (Pixel& pixel : softened_)
    std::copy_n(&frame.color.pixels[3 * std::size_t{pixel.at}], 3, pixel.color.data());
  const Linear behind = linear_color(background.data());
  // Background first: it takes its colour from skin as it was.
  for (const Pixel& pixel : softened_)
    if (change_[pixel.at] > 0) blend(pixel, behind, frame);
  for (const Pixel& pixel : softened_)
    if (change_[pixel.at] < 0) blend(pixel, behind, frame);
  for (const Pixel& pixel : softened_) change_[pixel.at] = 0;
  bits_ = nullptr;
}

void Outline::undo(Frame& frame) const {
  for (const Pixel& pixel : softened_)
    std::copy(pixel.color.begin(), pixel.color.end(),
              &frame.color.pixels[3 * std::size_t{pixel.at}]);
}

}  // namespace organbake
