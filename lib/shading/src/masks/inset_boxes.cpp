// SPDX-License-Identifier: GPL-3.0-or-later
//
// Rectangles that another picture fills, still or live, by their *seams*: straight lines along rows
// and columns over which the picture jumps in frame after frame, at one place, and beyond which
// another scene goes on. Edges of tissue pass, and are seldom straight. Four seams, or fewer and
// the frame's own border, make a rectangle. In: some frames spread over the clip. Frames that show
// a jump are counted instead of averaging it: one strong edge that passes by is one count.
#include "masks/searches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "organbake/shading/cv_grid.h"
#include "organbake/shading/masks.h"

namespace organbake {
namespace {

// How often there is a jump between a pixel and the one before it in its row, 0…1, with sums along
// the columns. Columns of the turned picture are rows of it.
struct SeamCounts {
  Plane share;
  Grid<double> sums, inside;  // one row more than the picture; of share and of pixels in the field

  double mean(int x, int first, int end) const {
    const double pixels = inside_of(x, first, end);
    return pixels > 0 ? (sums.at(x, end) - sums.at(x, first)) / pixels : 0;
  }
  double inside_of(int x, int first, int end) const {
    return inside.at(x, end) - inside.at(x, first);
  }
};

constexpr int kReach_px = 5;  // to either side that a jump is held against

// In any of the three channels.
bool jumps(const std::uint8_t* here) {
  constexpr int kLeast = 8;  // levels
  for (int c = 0; c < 3; ++c) {
    const auto level = [&](int right) { return int(here[c + 3 * right]); };
    const int jump = std::abs(level(1) - level(-2));
    if (jump >= kLeast && jump >= std::abs(level(-2) - level(-5)) + std::abs(level(4) - level(1)))
      return true;
  }
  return false;
}

SeamCounts count_seams(const std::vector<Rgb8Image>& samples, const Mask& field) {
  const int width = field.width, height = field.height;
  SeamCounts counts{Plane(width, height), Grid<double>(width, height + 1),
                    Grid<double>(width, height + 1)};
  for (const Rgb8Image& sample : samples)
    for (int y = 0; y < height; ++y)
      for (int x = kReach_px; x + kReach_px < width; ++x)
        counts.share.at(x, y) += jumps(sample.at(x, y));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const bool in = x > 0 && field.at(x, y) && field.at(x - 1, y);
      counts.share.at(x, y) = in ? counts.share.at(x, y) / static_cast<float>(samples.size()) : 0;
      counts.sums.at(x, y + 1) = counts.sums.at(x, y) + counts.share.at(x, y);
      counts.inside.at(x, y + 1) = counts.inside.at(x, y) + in;
    }
  return counts;
}

// Rows as columns.
template <class Picture>
Picture turned(const Picture& picture) {
  Picture result(picture.height, picture.width);
  cv::Mat target = cv_view(result);
  cv::transpose(cv_view(picture), target);
  return result;
}

constexpr double kSeam = 0.45;     // share of the frames that show one
constexpr double kLikely = 0.3;    // likewise, of a column that is worth a look
constexpr double kWeak = 0.5;      // of a part of a seam, by the whole
constexpr double kOverOthers = 2;  // times as often as a line beside it

// Columns that may be seams, the likeliest first: by the best run of what lies above kSeam.
std::vector<int> likely_columns(const SeamCounts& counts, double shortest_px) {
  constexpr std::size_t kMost = 14;
  constexpr int kApart_px = 3;
  const int width = counts.share.width, height = counts.share.height;
  std::vector<std::pair<double, int>> runs;
  for (int x = 0; x < width; ++x) {
    double best = 0, run = 0;
    for (int y = 0; y < height; ++y) {
      run = std::max(0.0, run + counts.share.at(x, y) - kLikely);
      best = std::max(best, run);
    }
    runs.emplace_back(best, x);
  }
  std::vector<std::pair<double, int>> likely;
  for (int x = 0; x < width; ++x) {
    bool peak = runs[x].first >= 0.15 * shortest_px;
    for (int other = std::max(0, x - kApart_px);
         peak && other <= std::min(width - 1, x + kApart_px); ++other)
      peak =
          runs[other].first < runs[x].first || (runs[other].first == runs[x].first && other >= x);
    if (peak) likely.push_back(runs[x]);
  }
  std::stable_sort(likely.begin(), likely.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<int> columns;
  for (std::size_t i = 0; i < std::min(likely.size(), kMost); ++i)
    columns.push_back(likely[i].second);
  return columns;
}

// From a line's pixel up to, not including, another.
struct Ends {
  int first = 0, end = 0;
};

// How sure one side of a rectangle is.
struct Side {
  bool open = false;  // the frame's border, or outside of the field of view
  double length = 0, seam = 0;
};

Side side_of(const SeamCounts& counts, int x, int first, int end) {
  const int width = counts.share.width, height = counts.share.height;
  Side side;
  if (x <= 0 || x >= width || counts.inside_of(x, first, end) < 0.2 * (end - first)) {
    side.open = true;
    return side;
  }
  side.length = counts.inside_of(x, first, end);
  side.seam = counts.mean(x, first, end);
  constexpr int kBeside_px = 7;
  double beside = 0;
  for (const int other : {x - kBeside_px, x + kBeside_px})
    if (other >= 0 && other < width) beside = std::max(beside, counts.mean(other, first, end));
  if (side.seam < kOverOthers * beside) side.seam = 0;
  // All along it, not at a few strong edges.
  constexpr int kParts = 8;
  int weak = 0, parts = 0;
  for (int i = 0; i < kParts; ++i) {
    const int a = first + (end - first) * i / kParts, b = first + (end - first) * (i + 1) / kParts;
    if (2 * counts.inside_of(x, a, b) < b - a) continue;
    ++parts;
    weak += counts.mean(x, a, b) < kWeak * side.seam;
  }
  if (weak > parts / kParts) side.seam = 0;
  // It ends with the rectangle.
  const int past = std::max(6, (end - first) / 8);
  for (const auto& [from, to] : {std::pair(first - past, first), std::pair(end, end + past)}) {
    const int a = std::max(0, from), b = std::min(height, to);
    if (b - a >= past / 2 && counts.mean(x, a, b) > 0.7 * side.seam) side.seam = 0;
  }
  return side;
}

class SeamSearch {
 public:
  SeamSearch(const std::vector<Rgb8Image>& samples, const Mask& field)
      : samples_(samples), field_(field), upright_(count_seams(samples, field)) {
    std::vector<Rgb8Image> lying;
    for (const Rgb8Image& sample : samples) lying.push_back(turned(sample));
    lying_ = count_seams(lying, turned(field));
    field_pixels_ = share_of(field) * static_cast<double>(field.size());
  }

  std::vector<Box> run() const {
    const int width = field_.width, height = field_.height;
    const double shortest = kShortestSide * std::max(width, height);
    std::vector<int> columns = likely_columns(upright_, shortest);
    std::vector<int> rows = likely_columns(lying_, shortest);
    columns.insert(columns.end(), {0, width});
    rows.insert(rows.end(), {0, height});
    std::vector<std::pair<double, Box>> found;
    for (const int left : columns)
      for (const int right : columns)
        for (const int top : rows)
          for (const int bottom : rows) {
            const Box box{left, top, right, bottom};
            if (right - left < shortest || bottom - top < shortest) continue;
            if (const double sure = sureness(box); sure > 0) found.emplace_back(sure, box);
          }
    std::stable_sort(found.begin(), found.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    std::vector<Box> boxes;
    constexpr std::size_t kMost = 4;
    for (const auto& [sure, box] : found)
      if (boxes.size() < kMost && shows_another_scene(box) &&
          std::all_of(boxes.begin(), boxes.end(),
                      [&](const Box& other) { return goes_with(box, other); }))
        boxes.push_back(box);
    for (Box& box : boxes) box = sharpened(box);
    return boxes;
  }

 private:
  static constexpr double kShortestSide = 0.035;  // of the larger side of the frame
  static constexpr double kLargest = 0.45;        // of the field of view: more is the scope's own

  // Each side where neighbouring pixels differ the most: a jump over three pixels is seen from two
  // places more.
  Box sharpened(const Box& box) const {
    Box sharp = box;
    sharp.left = sharpest(true, box.left, box.top, box.bottom);
    sharp.right = sharpest(true, box.right, box.top, box.bottom);
    sharp.top = sharpest(false, box.top, box.left, box.right);
    sharp.bottom = sharpest(false, box.bottom, box.left, box.right);
    return sharp;
  }

  int sharpest(bool upright, int at, int first, int end) const {
    const int across = upright ? field_.width : field_.height;
    if (at <= 1 || at + 1 >= across) return at;
    int best = at;
    double most = 0;
    for (int line = at - 1; line <= at + 1; ++line) {
      double sum = 0;
      for (const Rgb8Image& sample : samples_)
        for (int i = first; i < end; ++i) {
          const std::uint8_t* here = upright ? sample.at(line, i) : sample.at(i, line);
          const std::uint8_t* before = upright ? sample.at(line - 1, i) : sample.at(i, line - 1);
          sum += std::abs(here[0] - before[0]) + std::abs(here[1] - before[1]) +
                 std::abs(here[2] - before[2]);
        }
      if (sum <= most) continue;
      most = sum;
      best = line;
    }
    return best;
  }

  // Whether a box may be one beside a surer one: inside it, or else apart from it or round it, with
  // seams of its own.
  bool goes_with(const Box& box, const Box& surer) const {
    const auto within = [](const Box& in, const Box& out) {
      return in.left >= out.left && in.right <= out.right && in.top >= out.top &&
             in.bottom <= out.bottom;
    };
    const bool apart = box.left >= surer.right || surer.left >= box.right ||
                       box.top >= surer.bottom || surer.top >= box.bottom;
    if (within(box, surer)) return true;
    if (!apart && !within(surer, box)) return false;
    const Ends rows{box.top, box.bottom}, columns{box.left, box.right};
    const Ends its_rows{surer.top, surer.bottom}, its_columns{surer.left, surer.right};
    const std::array<double, 4> sides = {
        own_seam(upright_, box.left, rows, its_columns, its_rows),
        own_seam(upright_, box.right, rows, its_columns, its_rows),
        own_seam(lying_, box.top, columns, its_rows, its_columns),
        own_seam(lying_, box.bottom, columns, its_rows, its_columns)};
    return std::all_of(sides.begin(), sides.end(), [](double side) { return side >= 0; }) &&
           std::any_of(sides.begin(), sides.end(), [](double side) { return side > kReach_px; });
  }

  // How much more of a seam than kSeam a side has, without what it shares with another box, whose
  // sides lie at `lines` and reach over `reach`.
  static double own_seam(const SeamCounts& counts, int at, Ends side, Ends lines, Ends reach) {
    if (at <= 0 || at >= counts.share.width) return 0;
    double pixels = counts.inside_of(at, side.first, side.end);
    double seam = pixels * counts.mean(at, side.first, side.end);
    const Ends both{std::max(side.first, reach.first), std::min(side.end, reach.end)};
    const bool shares =
        std::abs(at - lines.first) <= kReach_px || std::abs(at - lines.end) <= kReach_px;
    if (shares && both.first < both.end) {
      const double shared = counts.inside_of(at, both.first, both.end);
      seam -= shared * counts.mean(at, both.first, both.end);
      pixels -= shared;
    }
    return seam - kSeam * pixels;
  }

  // The length of its seams by how often they show; 0 where it is no inset.
  double sureness(const Box& box) const {
    if (box.area() > kLargest * field_.size()) return 0;
    const std::array<Side, 4> sides = {side_of(upright_, box.left, box.top, box.bottom),
                                       side_of(upright_, box.right, box.top, box.bottom),
                                       side_of(lying_, box.top, box.left, box.right),
                                       side_of(lying_, box.bottom, box.left, box.right)};
    double length = 0, sure = 0;
    for (const Side& side : sides) {
      if (side.open) continue;
      if (side.seam < kSeam) return 0;
      length += side.length;
      sure += side.length * (side.seam - kSeam / 2);
    }
    if (length < 2 * kShortestSide * std::max(field_.width, field_.height)) return 0;
    double inside = 0;
    for (int y = box.top; y < box.bottom; ++y)
      for (int x = box.left; x < box.right; ++x) inside += field_.at(x, y);
    constexpr double kMostOfIt = 0.6;
    return inside > kMostOfIt * box.area() && inside < kLargest * field_pixels_ ? sure : 0;
  }

  // Whether beyond its seams the picture does not simply go on, as it does beyond a broken column
  // of the sensor: the levels along either side of a seam, without what is slow, have little in
  // common.
  bool shows_another_scene(const Box& box) const {
    double aa = 0, bb = 0, ab = 0;
    const auto along = [&](bool upright, int at, int first, int end) {
      const int across = upright ? field_.width : field_.height;
      if (at < kReach_px || at + kReach_px >= across) return;
      for (const Rgb8Image& sample : samples_) {
        const auto level = [&](int line, int i) {
          return double((upright ? sample.at(line, i) : sample.at(i, line))[1]);
        };
        constexpr int kSlow_px = 6;
        for (int i = first + kSlow_px; i + kSlow_px < end; ++i) {
          if (!(upright ? field_.at(at, i) : field_.at(i, at))) continue;
          const auto detail = [&](int line) {
            return level(line, i) - (level(line, i - kSlow_px) + level(line, i + kSlow_px)) / 2;
          };
          const double a = detail(at - 3), b = detail(at + 2);
          aa += a * a;
          bb += b * b;
          ab += a * b;
        }
      }
    };
    along(true, box.left, box.top, box.bottom);
    along(true, box.right, box.top, box.bottom);
    along(false, box.top, box.left, box.right);
    along(false, box.bottom, box.left, box.right);
    constexpr double kAlike = 0.5;
    return ab <= kAlike * std::sqrt(aa * bb);
  }

  const std::vector<Rgb8Image>& samples_;
  const Mask& field_;
  SeamCounts upright_, lying_;
  double field_pixels_ = 0;
};

}  // namespace

std::vector<Box> boxes_of_seams(const std::vector<Rgb8Image>& frames, const Mask& field) {
  return SeamSearch(frames, field).run();
}

}  // namespace organbake
