// SPDX-License-Identifier: GPL-3.0-or-later
// What closed contours in one plane enclose (PS3.3, C.8.8.6.3), row by row: in, polygons; out, the
// stretches of a row that lie inside.
#include "dicom/dicom.h"

#include <algorithm>
#include <iterator>

namespace organbake {
namespace {

using Contour = ContourRegion::Contour;

// Where a row crosses the contour's edges: inside lies between odd and even.
Spans spans_of(const Contour& contour, double y) {
  std::vector<double> at;
  for (const Polygon2& polygon : contour) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      if ((a.y() <= y) == (b.y() <= y)) continue;
      at.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
    }
  }
  std::sort(at.begin(), at.end());
  Spans spans;
  for (std::size_t i = 0; i + 1 < at.size(); i += 2) spans.emplace_back(at[i], at[i + 1]);
  return spans;
}

Spans united(const Spans& a, const Spans& b) {
  Spans all;
  std::merge(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all));
  Spans spans;
  for (const auto& [from, to] : all) {
    if (spans.empty() || from > spans.back().second) {
      spans.emplace_back(from, to);
    } else {
      spans.back().second = std::max(spans.back().second, to);
    }
  }
  return spans;
}

Spans without(const Spans& a, const Spans& taken) {
  Spans spans;
  for (auto [from, to] : a) {
    for (const auto& [begin, end] : taken) {
      if (end <= from || begin >= to) continue;
      if (begin > from) spans.emplace_back(from, begin);
      from = std::min(end, to);
    }
    if (from < to) spans.emplace_back(from, to);
  }
  return spans;
}

Spans common(const Spans& a, const Spans& b) { return without(a, without(a, b)); }

Spans moved_apart(Spans spans, double by) {
  for (auto& [from, to] : spans) from -= by, to += by;
  std::erase_if(spans, [](const auto& span) { return span.first > span.second; });
  return spans;
}

double length(const Spans& spans) {
  double sum = 0;
  for (const auto& [from, to] : spans) sum += to - from;
  return sum;
}

Eigen::AlignedBox2d box_of(const Contour& contour) {
  Eigen::AlignedBox2d box;
  for (const Polygon2& polygon : contour)
    for (const Eigen::Vector2d& p : polygon) box.extend(p);
  return box;
}

// A hole is often drawn up to its organ's own edge, and a little beyond.
constexpr double kWholly = 0.99;

// Whether nearly all of a contour's area lies inside another, by rows across it.
bool lies_inside(const Contour& contour, const Contour& other) {
  constexpr int kRows = 64;
  const Eigen::AlignedBox2d box = box_of(contour), around = box_of(other);
  const Eigen::Vector2d slack = (1 - kWholly) * box.sizes();
  if (((box.min() + slack).array() < around.min().array()).any() ||
      ((box.max() - slack).array() > around.max().array()).any())
    return false;
  double all = 0, outside = 0;
  for (int row = 0; row < kRows; ++row) {
    const double y = box.min().y() + (row + 0.5) / kRows * box.sizes().y();
    const Spans own = spans_of(contour, y);
    all += length(own);
    outside += length(without(own, spans_of(other, y)));
  }
  return all > 0 && outside <= (1 - kWholly) * all;
}

}  // namespace

ContourRegion::ContourRegion(std::vector<Contour> contours) {
  for (Contour& contour : contours) {
    bool again = false;
    for (const Layered& known : contours_)
      again |= lies_inside(contour, known.contour) && lies_inside(known.contour, contour);
    repeated_ += again;
    if (!again) contours_.push_back({std::move(contour)});
  }
  const std::size_t count = contours_.size();
  std::vector<std::vector<bool>> inside(count, std::vector<bool>(count));
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < count; ++j)
      inside[i][j] = i != j && lies_inside(contours_[i].contour, contours_[j].contour);
  // One deeper than the deepest that holds it: settled after as many rounds as there are levels.
  bool changed = count > 1;
  for (std::size_t round = 0; changed && round < count; ++round) {
    changed = false;
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < count; ++j) {
        if (!inside[i][j] || contours_[i].depth > contours_[j].depth) continue;
        contours_[i].depth = contours_[j].depth + 1;
        changed = true;
      }
    }
  }
  for (const Layered& one : contours_) holes_ += one.depth % 2;
  std::stable_sort(contours_.begin(), contours_.end(),
                   [](const Layered& a, const Layered& b) { return a.depth < b.depth; });
}

Spans ContourRegion::row(double y, double reach) const {
  Spans spans;
  for (const Layered& one : contours_) {
    const Spans below = spans_of(one.contour, y - reach);
    const Spans above = reach > 0 ? spans_of(one.contour, y + reach) : below;
    if (one.depth % 2 == 0) {
      spans = united(spans, moved_apart(united(below, above), reach));
    } else {
      spans = without(spans, moved_apart(common(below, above), -reach));
    }
  }
  return spans;
}

}  // namespace organbake
