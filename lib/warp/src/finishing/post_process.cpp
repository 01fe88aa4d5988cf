// SPDX-License-Identifier: Apache-2.0
// What follows a frame's drawing, in order; and how outlines are smoothed, by the share of each
// pixel that the skin covers.
#include "finishing/post_process.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

using Linear = std::array<float, 3>;

constexpr double kSteps = 254;  // of a pixel's share; half a pixel is the most that changes

Linear linear_color(const std::uint8_t* rgb) {
  const auto& table = linear_from_srgb8();
  return {table[rgb[0]], table[rgb[1]], table[rgb[2]]};
}

// By how much more of a pixel, or less, the skin in front covers than its centre says.
struct Change {
  std::uint32_t at;
  std::int8_t steps;
};

// The skin in front beside what lies behind, from one pair of pixels on to the right or down.
struct Border {
  const FrontEdges& edges;
  FrontEdges::Along pair;   // of pairs in a column the border runs along a row; else down a column
  FrontEdges::Front front;  // the side that is in front
  PixelAt first;            // of the pixels on the left or upper side

  bool to_right() const { return pair == FrontEdges::column; }
  bool skin_first() const { return front == FrontEdges::first; }
  PixelAt near(int i) const {
    return to_right() ? PixelAt{first.x + i, first.y} : PixelAt{first.x, first.y + i};
  }
  PixelAt far(int i) const {
    const PixelAt side = near(i);
    return to_right() ? PixelAt{side.x, side.y + 1} : PixelAt{side.x + 1, side.y};
  }
  PixelAt skin(int i) const { return skin_first() ? near(i) : far(i); }
  PixelAt open(int i) const { return skin_first() ? far(i) : near(i); }
  bool goes_on(int i) const { return edges.has(pair, front, near(i)); }

  double rise(int length, BorderStep ends) const;
  void follow(int width, std::vector<Change>& changes) const;
};

// How far the outline of a stretch rises whose ends both step to one side, by the stretches that
// the border goes on with.
double Border::rise(int length, BorderStep ends) const {
  Border next = *this;
  (to_right() ? next.first.y : next.first.x) += skin_first() ? ends : -ends;
  const auto count = [&](int from, int direction) {
    int n = 0;
    while (next.goes_on(from + direction * n)) ++n;
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

// A stretch without a step, from its first pixel on. width: of the picture.
void Border::follow(int width, std::vector<Change>& changes) const {
  int length = 1;
  while (goes_on(length)) ++length;
  // Beyond the stretch's last pair, i, lies the pair `next`.
  const auto step = [&](int i, int next) {
    return static_cast<BorderStep>(int{edges.in_front(open(next), open(i))} -
                                   int{edges.in_front(skin(i), skin(next))});
  };
  const BorderStep before = step(0, -1), after = step(length - 1, length);
  if (before == no_step && after == no_step) return;
  const bool bow = before == after;
  const double height = bow ? rise(length, before) : 0;
  const auto change = [&](PixelAt pixel, double share) {
    const int steps = static_cast<int>(kSteps * share);
    if (steps == 0) return;
    const auto at = static_cast<std::uint32_t>(pixel.y * width + pixel.x);
    changes.push_back({at, static_cast<std::int8_t>(steps)});
  };
  for (int i = 0; i < length; ++i) {
    const OutlineAreas areas =
        bow ? areas_of_bow(length, before, height, i) : areas_of_slope(length, before, after, i);
    change(open(i), areas.of_open);
    change(skin(i), -areas.of_skin);
  }
}

// The borders of some pairs that begin in a row: those that run along it, or down from it.
void follow_row(const FrontEdges& edges, FrontEdges::Along pair, FrontEdges::Front front, int y,
                int width, std::vector<Change>& changes) {
  const CoverMask& bits = edges.skin();
  const bool to_right = pair == FrontEdges::column;
  const std::uint64_t* const borders = edges.of_row(pair, front, y);
  const std::uint64_t* const above =
      !to_right && y > bits.box().y0 ? edges.of_row(pair, front, y - 1) : nullptr;
  for (int word = 0; word < bits.words(); ++word) {
    const std::uint64_t before = to_right ? bits.right_of(borders, word)
                                 : above  ? above[word]
                                          : std::uint64_t{0};
    bits.for_each(borders[word] & ~before, word, y, [&](PixelAt first) {
      Border{edges, pair, front, first}.follow(width, changes);
    });
  }
}

// Some rows at a time, at once: what they change is in the order of rows, first of pairs in
// columns.
std::vector<std::vector<Change>> follow_all(const FrontEdges& edges, int width) {
  constexpr int kRows = 32;
  const PixelBox& box = edges.skin().box();
  const int pieces = (box.height() + kRows - 1) / kRows;
  std::vector<std::vector<Change>> changes(std::size_t{3} * pieces);
  using enum FrontEdges::Along;
  using enum FrontEdges::Front;
  parallel_for(0, 3 * pieces, [&](int i) {
    const int begin = box.y0 + i % pieces * kRows, end = std::min(begin + kRows, box.y1);
    for (int y = begin; y < end; ++y) {
      if (i >= pieces) {
        follow_row(edges, row, i < 2 * pieces ? first : second, y, width, changes[i]);
      } else if (y + 1 < box.y1) {
        for (const FrontEdges::Front front : {first, second})
          follow_row(edges, column, front, y, width, changes[i]);
      }
    }
  });
  return changes;
}

// A pixel takes the colours beside it of what covers more of it than its centre says: of the skin
// in front of it, or of what lies behind it.
std::array<std::uint8_t, 3> blended(const FrontEdges& edges, const Frame& frame, PixelAt at,
                                    double share) {
  Linear others{};
  int count = 0;
  for (const auto [dx, dy] : {std::array{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
    const PixelAt beside{at.x + dx, at.y + dy};
    if (!(share > 0 ? edges.in_front(beside, at) : edges.in_front(at, beside))) continue;
    const Linear color = linear_color(frame.color.at(beside.x, beside.y));
    for (int c = 0; c < 3; ++c) others[c] += color[c];
    ++count;
  }
  const Linear own = linear_color(frame.color.at(at.x, at.y));
  const double weight = std::abs(share) / count;
  std::array<std::uint8_t, 3> mixed;
  for (int c = 0; c < 3; ++c) {
    const double light = weight * others[c] + (1 - std::abs(share)) * own[c];
    mixed[c] = srgb8_from_linear(static_cast<float>(light));
  }
  return mixed;
}

}  // namespace

void Outline::soften(const FrontEdges& edges, Frame& frame, KeptPixels& kept) {
  if (edges.empty()) return;
  const int width = frame.color.width;
  change_.resize(frame.cover.size());
  struct Pixel {
    std::uint32_t at;
    std::array<std::uint8_t, 3> softened;  // sRGB
  };
  std::vector<Pixel> pixels;
  for (const std::vector<Change>& of_piece : follow_all(edges, width))
    for (const auto& [at, steps] : of_piece) {
      // Aslant, a border has stretches both ways: the longer ones tell more.
      if (std::abs(int{steps}) <= std::abs(int{change_[at]})) continue;
      if (change_[at] == 0) pixels.push_back({at, {}});
      change_[at] = steps;
    }
  constexpr std::size_t kGrain = 128;
  parallel_each(std::size_t{0}, pixels.size(), kGrain, [&](std::size_t i) {
    const int at = static_cast<int>(pixels[i].at);
    pixels[i].softened =
        blended(edges, frame, {at % width, at / width}, change_[pixels[i].at] / kSteps);
  });
  // Only now: each takes its neighbours' colours as they were.
  for (const auto& [at, softened] : pixels) {
    kept.keep(at, frame);
    std::copy(softened.begin(), softened.end(), &frame.color.pixels[3 * std::size_t{at}]);
    change_[at] = 0;
  }
}

void smooth_outlines(Frame& frame, const SkinDepth* depth, float deeper_mm) {
  CoverMask skin;
  skin.read({0, 0, frame.color.width, frame.color.height}, frame);
  FrontEdges edges;
  edges.find(skin, depth, deeper_mm);
  KeptPixels kept;
  Outline().soften(edges, frame, kept);
}

OutlineAreas areas_of_slope(int length, BorderStep before, BorderStep after, int i) {
  const double half = 0.5 * length;
  // Under a line that falls from half a pixel at the end to none in the middle.
  const auto area = [half](double from) {
    const double to = std::min(from + 1, half);
    return from < to ? (to - from) / 2 * (1 - (to + from) / (2 * half)) : 0;
  };
  const double left = area(i), right = area(length - 1 - i);
  return {(before == to_open ? left : 0) + (after == to_open ? right : 0),
          (before == to_skin ? left : 0) + (after == to_skin ? right : 0)};
}

OutlineAreas areas_of_bow(int length, BorderStep ends, double rise, int i) {
  // Of 1/2 − rise (1 − u²) along the stretch, u from −1 to 1.
  const auto integral = [&](double u) {
    return 0.5 * length * u * (0.5 - rise + rise * u * u / 3);
  };
  const double from = 2.0 * i / length - 1, to = 2.0 * (i + 1) / length - 1;
  const double crossing = rise > 0.5 ? std::sqrt(1 - 0.5 / rise) : 0;
  const double a = std::clamp(from, -crossing, crossing), b = std::clamp(to, -crossing, crossing);
  const double beyond = integral(a) - integral(b);
  const double before = integral(to) - integral(from) + beyond;
  return ends == to_open ? OutlineAreas{before, beyond} : OutlineAreas{beyond, before};
}

void KeptPixels::keep(const PixelBox& box, const Frame& frame) {
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x) keep(std::size_t(y) * frame.color.width + x, frame);
}

void KeptPixels::restore(Frame& frame) const {
  for (auto pixel = pixels_.rbegin(); pixel != pixels_.rend(); ++pixel) {
    std::copy(pixel->color.begin(), pixel->color.end(),
              &frame.color.pixels[3 * std::size_t{pixel->at}]);
    frame.cover[pixel->at] = pixel->cover;
    if (!frame.depth_mm.empty()) frame.depth_mm[pixel->at] = pixel->depth;
  }
}

void PostProcess::draw_tools(const View& view, const DrawOptions& options, Frame& frame) {
  const bool at_scope = options.light == DrawnLight::scope;
  const auto light_mm = at_scope ? std::optional(light_mm_) : std::nullopt;
  draw_blood(options.blood, view, light_mm, frame, kept_);
  const std::vector<PictureBlock> blocks = solid_blocks(options.solids, view);
  for (const PictureBlock& block : blocks) kept_.keep(block.box, frame);
  if (options.relights()) shade_skin_by_solids(options.solids, view, light_mm, frame, kept_);
  draw_solids(options.solids, blocks, view, at_scope, frame);
  draw_smoke(options.smoke, view, frame, kept_);
}

void PostProcess::apply(const View& view, const DrawOptions& options, const PixelBox& drawn,
                        const SkinDepth& depth, float deeper_mm, Frame& frame, DrawReport& report) {
  PhaseClock clock(options.measure);
  kept_.clear();
  for (const std::uint32_t pixel : find_see_through(drawn, depth, deeper_mm)) {
    kept_.keep(pixel, frame);
    frame.cover[pixel] = Cover::background;
  }
  skin_.read(drawn, frame);
  report.filled_pixels = fill_slits(skin_, frame, kept_);
  const int fade_px = finish_.border_fade_px(view.camera.intrinsics.fx);
  fade_borders(drawn, options.smooth_outline ? fade_px : 0, options.background, frame, kept_);
  if (!options.solids.empty() || !options.blood.empty() || !options.smoke.empty()) {
    clock.lap(report.times.fill, report.critical_path.fill);
    draw_tools(view, options, frame);
    clock.lap(report.times.tools, report.critical_path.tools);
    skin_.read(drawn, frame);
  }
  if (!options.smooth_outline) skin_ = {};
  edges_.find(skin_, &depth, deeper_mm);
  outline_.soften(edges_, frame, kept_);
  clock.lap(report.times.fill, report.critical_path.fill);
}

}  // namespace organbake
