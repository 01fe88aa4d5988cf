// SPDX-License-Identifier: GPL-3.0-or-later
// Shafts of instruments by their shape. Line segments (von Gioi et al., LSD, 2010; OpenCV's) of the
// brightness and of the hue are taken two by two as the borders of a strip; the strip is followed
// both ways for as long as its inside differs from what lies right beside it, and its borders are
// fitted anew to what was followed. No colour by itself makes an instrument: fat, film and paled or
// smoky tissue are grey, too, but not straight, not sharp on both sides, and not from the rim.
#include "masks/searches.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "organbake/core/quantile.h"

namespace organbake {
namespace {

// Of hue, against the picture's usual tissue.
constexpr double kLessHue = 0.2, kGreyHue = 0.6;
// Steel is as grey as the lamp, or mirrors the tissue about it. The energy across to that along: in
// what is grey, of all changes; in what is not, of lines alone, of which mirrors in a real clip
// have 2.6 and more, gallbladders, which are pale and straight, too, 1.5 at most.
constexpr double kSteel = 0.25, kStreaks = 1.5, kLines = 2;
constexpr double kShortestSegment = 0.03;  // of the picture's longest side
constexpr double kNarrowest = 4.0;         // px of the reduced picture
constexpr double kWidest = 0.3;            // of its longest side
constexpr double kLeastLength = 0.06;      // the same
constexpr double kMostOpening = 0.14;      // rad between the borders

struct Segment {
  cv::Point2d a, b;
  double length() const { return cv::norm(b - a); }
  cv::Point2d direction() const { return (b - a) / length(); }
};

cv::Mat as_levels(const cv::Mat& values, double low, double high) {
  cv::Mat levels;
  values.convertTo(levels, CV_8U, 255 / (high - low), -255 * low / (high - low));
  return levels;
}

void add_segments(const cv::Mat& levels, double shortest, std::vector<Segment>& segments) {
  constexpr double kScale = 0.6;  // of the reduced picture: at 1 noise breaks segments
  std::vector<cv::Vec4f> found;
  cv::createLineSegmentDetector(cv::LSD_REFINE_STD, kScale)->detect(levels, found);
  for (const cv::Vec4f& line : found) {
    const Segment segment{{line[0], line[1]}, {line[2], line[3]}};
    if (segment.length() >= shortest) segments.push_back(segment);
  }
}

// The strip between two segments, or nothing where they are no two borders of one.
std::optional<Shaft> between(const Segment& one, const Segment& other, double longest_side) {
  const cv::Point2d u = one.direction();
  cv::Point2d v = other.direction();
  if (u.dot(v) < 0) v = -v;
  if (std::abs(u.cross(v)) > std::sin(kMostOpening)) return std::nullopt;
  Shaft shaft;
  shaft.along = (u + v) / cv::norm(u + v);
  shaft.origin = 0.25 * (one.a + one.b + other.a + other.b);
  double from[2], to[2];
  for (int k = 0; k < 2; ++k) {
    const Segment& segment = k ? other : one;
    const cv::Point2d a = segment.a - shaft.origin, b = segment.b - shaft.origin;
    const double ta = a.dot(shaft.along), tb = b.dot(shaft.along);
    const double oa = a.dot(shaft.across()), ob = b.dot(shaft.across());
    shaft.border[k][1] = (ob - oa) / (tb - ta);
    shaft.border[k][0] = oa - shaft.border[k][1] * ta;
    from[k] = std::min(ta, tb), to[k] = std::max(ta, tb);
  }
  shaft.from = std::max(from[0], from[1]), shaft.to = std::min(to[0], to[1]);
  const double shorter = std::min(one.length(), other.length());
  if (shaft.to - shaft.from < 0.4 * shorter) return std::nullopt;
  if (shaft.border[0][0] > shaft.border[1][0]) std::swap(shaft.border[0], shaft.border[1]);
  const double width = shaft.width(0.5 * (shaft.from + shaft.to));
  if (width < kNarrowest || width > kWidest * longest_side) return std::nullopt;
  if (shaft.to - shaft.from < 0.3 * width) return std::nullopt;
  return shaft;
}

// One step along a strip: its inside, and both sides of both borders.
struct StripStep {
  StripMean inside, within[2], beside[2];
};

StripStep step_at(const ShaftView& view, const Shaft& shaft, double t) {
  StripStep step;
  const double low = shaft.edge(0, t), high = shaft.edge(1, t);
  const int reach = std::clamp(static_cast<int>((high - low) / 4), 2, 6);
  for (int row = -1; row <= 1; ++row) {
    for (double o = low + 1; o <= high - 1; ++o)
      step.inside.add(view, view.hue, shaft.at(t + row, o));
    for (int k = 1; k <= reach; ++k) {
      step.within[0].add(view, view.hue, shaft.at(t + row, low + k));
      step.within[1].add(view, view.hue, shaft.at(t + row, high - k));
      step.beside[0].add(view, view.hue, shaft.at(t + row, low - k));
      step.beside[1].add(view, view.hue, shaft.at(t + row, high + k));
    }
  }
  return step;
}

// How many sides have the hue that the inside has lost. One that lies outside the field of view
// tells nothing: the picture's own edge is straight, too.
int sides_told(const ShaftView& view, const Shaft& shaft, double t) {
  const StripStep step = step_at(view, shaft, t);
  if (!step.inside.tells() || step.inside.mean() > kGreyHue) return 0;
  int told = 0;
  for (int side = 0; side < 2; ++side)
    if (step.beside[side].tells() && step.within[side].tells())
      told += step.beside[side].mean() - step.within[side].mean() >= kLessHue;
  return told;
}

// Where the strip, followed from `start`, ends; `direction` is 1 or −1. Both sides must tell it, or
// one where `sides` is 1.
double followed(const ShaftView& view, const Shaft& shaft, double start, int direction, int sides) {
  constexpr double kGap = 12;  // px: highlights, dirt
  double last = start;
  for (double t = start; std::abs(t - last) <= kGap; t += direction) {
    const cv::Point2d middle = shaft.at(t, 0.5 * (shaft.edge(0, t) + shaft.edge(1, t)));
    if (shaft.width(t) < 0.6 * kNarrowest || !view.holds(middle.x, middle.y)) break;
    if (sides_told(view, shaft, t) >= sides) last = t;
  }
  return last;
}

// Follows a strip both ways; false where not even its middle is one.
bool follow(const ShaftView& view, Shaft& shaft) {
  const double start = 0.5 * (shaft.from + shaft.to);
  if (sides_told(view, shaft, start) < 2) return false;
  shaft.from = followed(view, shaft, start, -1, 2);
  shaft.to = followed(view, shaft, start, 1, 2);
  return true;
}

// Goes on where one side alone tells the strip: the other is as grey itself, or in the dark.
void extend(const ShaftView& view, Shaft& shaft) {
  shaft.from = followed(view, shaft, shaft.from, -1, 1);
  shaft.to = followed(view, shaft, shaft.to, 1, 1);
}

// Whether what lies just beyond an end is outside the field of view, straight on or by a corner.
bool is_at_rim(const ShaftView& view, const Shaft& shaft, double end, double beyond) {
  const double middle = 0.5 * (shaft.edge(0, beyond) + shaft.edge(1, beyond));
  const cv::Point2d tried[] = {shaft.at(beyond, middle), shaft.at(end, shaft.edge(0, end)),
                               shaft.at(end, shaft.edge(1, end))};
  return !std::all_of(std::begin(tried), std::end(tried),
                      [&](const cv::Point2d& p) { return view.holds(p.x, p.y); });
}

// How far it is from an end to the rim through nothing but the dark, which hides the rest of a
// shaft; infinite where tissue lies between.
double dark_way(const ShaftView& view, const Shaft& shaft, double end, double outward) {
  const double most = shaft.to - shaft.from;
  for (double way = 1; way <= most; ++way) {
    const double t = end + outward * way;
    if (is_at_rim(view, shaft, t, t)) return way;
    const StripStep step = step_at(view, shaft, t);
    const bool lit_beside = step.beside[0].tells() || step.beside[1].tells();
    if (step.inside.tells() && (lit_beside || step.inside.mean() > kGreyHue)) break;
  }
  return std::numeric_limits<double>::infinity();
}

// Draws the strip out over what lies between its ends and the rim, where that is little (knobs and
// blur have no straight borders) or, at one end, dark. Whether it leaves the field of view at one
// of its ends.
bool draw_out_to_rim(const ShaftView& view, Shaft& shaft) {
  constexpr double kNear = 14;  // px
  bool enters = false;
  for (double* end : {&shaft.from, &shaft.to}) {
    const double outward = end == &shaft.from ? -1 : 1;
    const double beyond = *end + outward * (kNear + 0.25 * shaft.width(*end));
    if (!is_at_rim(view, shaft, *end, beyond)) continue;
    enters = true;
    *end = beyond;
  }
  if (enters) return true;
  const double before = dark_way(view, shaft, shaft.from, -1);
  const double behind = dark_way(view, shaft, shaft.to, 1);
  if (std::isinf(std::min(before, behind))) return false;
  before < behind ? shaft.from -= before : shaft.to += behind;
  return true;
}

double hue_at(const ShaftView& view, cv::Point2d p) {
  if (!view.holds(p.x, p.y)) return 1;
  return view.hue.at<float>(static_cast<int>(p.y), static_cast<int>(p.x));
}

// Fits the borders anew to where the hue changes most, along all that was followed.
void fit_borders(const ShaftView& view, Shaft& shaft) {
  constexpr int kSearch = 4;
  for (int side = 0; side < 2; ++side) {
    std::vector<cv::Point2f> points;
    const double outward = side == 0 ? -1 : 1;
    for (double t = shaft.from; t <= shaft.to; ++t) {
      double best = 0, place = 0;
      for (double o = -kSearch; o <= kSearch; o += 0.5) {
        const double edge = shaft.edge(side, t) + o;
        const double rise =
            hue_at(view, shaft.at(t, edge + outward)) - hue_at(view, shaft.at(t, edge - outward));
        if (rise > best) best = rise, place = edge;
      }
      if (best > 0.5 * kLessHue) points.emplace_back(t, place);
    }
    if (points.size() < 5) continue;
    cv::Vec4f line;  // direction, point
    cv::fitLine(points, line, cv::DIST_HUBER, 0, 0.01, 0.01);
    if (std::abs(line[0]) < 0.9) continue;
    shaft.border[side][1] = line[1] / line[0];
    shaft.border[side][0] = line[3] - shaft.border[side][1] * line[2];
  }
}

// How much more the brightness changes across the strip than along it, as shares of energy: light
// and reflections run along a shaft; tissue is as uneven either way. Or how much more it bends: a
// round organ's shading is smooth but at its borders, what steel mirrors lies in lines.
double streaks(const ShaftView& view, const Shaft& shaft, bool bends) {
  constexpr double kEven = 0.01;  // change of the logarithm over 3 px that no tissue stays below
  constexpr double kReach = 1.5, kBorder = 0.15;  // px; of the width
  const auto level = [&](double t, double o) {
    const cv::Point2d p = shaft.at(t, o);
    const int x = std::clamp(static_cast<int>(p.x), 0, view.level.cols - 1);
    const int y = std::clamp(static_cast<int>(p.y), 0, view.level.rows - 1);
    return double(view.level.at<float>(y, x));
  };
  const auto change = [&](double before, double here, double behind) {
    return bends ? before - 2 * here + behind : behind - before;
  };
  double across = 0, along = 0, count = 0;
  for (double t = shaft.from + 1; t <= shaft.to - 1; ++t) {
    const double border = kReach + (bends ? kBorder * shaft.width(t) : 0);
    for (double o = shaft.edge(0, t) + border; o <= shaft.edge(1, t) - border; ++o) {
      const cv::Point2d p = shaft.at(t, o);
      if (!view.holds(p.x, p.y)) continue;
      const double here = level(t, o);
      across += std::pow(change(level(t, o - kReach), here, level(t, o + kReach)), 2);
      along += std::pow(change(level(t - kReach, o), here, level(t + kReach, o)), 2);
      ++count;
    }
  }
  const bool even = along < kEven * kEven * count;
  return even ? std::numeric_limits<double>::infinity() : across / std::max(1e-9, along);
}

double hue_inside(const ShaftView& view, const Shaft& shaft) {
  std::vector<float> hues;
  for (double t = shaft.from; t <= shaft.to; ++t) {
    const StripStep step = step_at(view, shaft, t);
    if (step.inside.tells()) hues.push_back(step.inside.mean());
  }
  return hues.empty() ? 1 : median(std::move(hues));
}

// What a strip must be to be an instrument: twice as long as wide, told by both sides over most of
// its length, and streaked along.
bool is_instrument(const ShaftView& view, const Shaft& shaft, double told) {
  const double longest = std::max(view.inside.cols, view.inside.rows);
  const double length = shaft.to - shaft.from;
  const double width = shaft.width(0.5 * (shaft.from + shaft.to));
  if (told < 0.5 * length || length < std::max(kLeastLength * longest, 2 * width)) return false;
  if (hue_inside(view, shaft) < kSteel) return streaks(view, shaft, false) >= kStreaks;
  return streaks(view, shaft, true) >= kLines;
}

// Whether two segments are known as the borders of a shaft already.
bool is_known(const std::vector<Shaft>& shafts, const Shaft& shaft) {
  return std::any_of(shafts.begin(), shafts.end(), [&](const Shaft& known) {
    const cv::Point2d middle = shaft.at(0.5 * (shaft.from + shaft.to), 0) - known.origin;
    const double t = middle.dot(known.along), o = middle.dot(known.across());
    return t > known.from && t < known.to && o > known.edge(0, t) && o < known.edge(1, t) &&
           std::abs(known.along.dot(shaft.along)) > std::cos(kMostOpening);
  });
}

}  // namespace

std::vector<Shaft> find_shafts(const ShaftView& view) {
  const double longest = std::max(view.inside.cols, view.inside.rows);
  std::vector<Segment> segments;
  add_segments(as_levels(view.level, 2.5, 5.7), kShortestSegment * longest, segments);
  add_segments(as_levels(view.hue, -0.5, 1.5), kShortestSegment * longest, segments);
  std::vector<Shaft> shafts;
  for (std::size_t i = 0; i < segments.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      std::optional<Shaft> shaft = between(segments[i], segments[j], longest);
      if (!shaft || is_known(shafts, *shaft) || !follow(view, *shaft)) continue;
      fit_borders(view, *shaft);
      if (!follow(view, *shaft)) continue;
      const double told = shaft->to - shaft->from;
      extend(view, *shaft);
      if (is_instrument(view, *shaft, told) && draw_out_to_rim(view, *shaft))
        shafts.push_back(*shaft);
    }
  return shafts;
}

}  // namespace organbake
