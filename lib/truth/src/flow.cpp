// SPDX-License-Identifier: Apache-2.0
// Row by row, while what is asked for lies in the cache: where a row's points were and are, by runs
// of one face side by side, and where they land; then whether they are seen there, by what lands
// round them and by the depth of the other picture.
#include "organbake/truth/pixel_truth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "flow_kernels.h"
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

using Eigen::Vector3f;

FlowLens lens_of(const View& view) {
  const Intrinsics& k = view.camera.intrinsics;
  return {static_cast<float>(k.fx), static_cast<float>(k.fy), static_cast<float>(k.cx),
          static_cast<float>(k.cy), static_cast<float>(view.near_mm)};
}

// Which solid of a moment is the same part of the same instrument in another, by number.
std::vector<int> partners(const std::vector<Solid>& from, const std::vector<Solid>& to) {
  std::vector<int> found(from.size(), -1);
  const auto part_of = [](const std::vector<Solid>& solids, std::size_t s) {
    std::size_t part = 0;
    for (std::size_t i = 0; i < s; ++i) part += solids[i].instrument == solids[s].instrument;
    return part;
  };
  for (std::size_t s = 0; s < from.size(); ++s)
    for (std::size_t t = 0; t < to.size(); ++t)
      if (from[s].instrument == to[t].instrument && part_of(from, s) == part_of(to, t))
        found[s] = static_cast<int>(t);
  return found;
}

// Of a point of a solid, as its axis or its triangle moved; spin about an axis cannot be told.
Eigen::Vector3d shift_of(const Eigen::Vector3d& point, const Solid& was, const Solid& is) {
  const Eigen::Vector3d axis = was.to - was.from;
  const double length2 = axis.squaredNorm();
  if (was.corner && is.corner) {
    // By least squares; the normal equations, since a triangle's sides are seldom near one line.
    const Eigen::Vector3d side = *was.corner - was.from, arm = point - was.from;
    const double side2 = side.squaredNorm(), both = axis.dot(side);
    constexpr double kOneLine = 1e-12;  // of the square of its area, where a triangle has none
    const double area2 = length2 * side2 - both * both;
    if (area2 > kOneLine * length2 * side2) {
      const double b = (side2 * axis.dot(arm) - both * side.dot(arm)) / area2;
      const double c = (length2 * side.dot(arm) - both * axis.dot(arm)) / area2;
      return (1 - b - c) * (is.from - was.from) + b * (is.to - was.to) +
             c * (*is.corner - *was.corner);
    }
  }
  const double along =
      length2 > 0 ? std::clamp((point - was.from).dot(axis) / length2, 0.0, 1.0) : 0;
  return (1 - along) * (is.from - was.from) + along * (is.to - was.to);
}

// A number for each pixel of a row, with room for a vector on both sides.
template <class Number>
class Row {
 public:
  explicit Row(int width, Number start = 0)
      : numbers_(static_cast<std::size_t>(width) + 2 * kFlowLanes, start) {}
  Number& operator[](int i) { return numbers_[static_cast<std::size_t>(i) + kFlowLanes]; }
  const Number& operator[](int i) const {
    return numbers_[static_cast<std::size_t>(i) + kFlowLanes];
  }
  void fill(Number value) { std::fill(numbers_.begin(), numbers_.end(), value); }

 private:
  std::vector<Number> numbers_;
};

// Camera mm.
struct RowPoints {
  Row<float> x, y, z;

  explicit RowPoints(int width) : x(width), y(width), z(width) {}
  void put(int i, const Vector3f& p) { x[i] = p.x(), y[i] = p.y(), z[i] = p.z(); }
};

// Of a row's points: where they land in the other picture, px, and how deep; and where they are in
// their own. Between its first and last pixel that shows anything; nowhere outside.
struct LandedRow {
  int first = 0, last = 0;
  Row<float> x, y, depth_mm, own_x, own_y;
  Row<std::int32_t> label;

  explicit LandedRow(int width)
      : x(width, kNowhere),
        y(width, kNowhere),
        depth_mm(width),
        own_x(width),
        own_y(width),
        label(width) {}
  FlowPlaces at(int i) const { return {&x[i], &y[i], &label[i]}; }
};

class RowMover {
 public:
  RowMover(const PixelTruth& from, const Moment& then, const Moment& now)
      : from_(from),
        then_(then),
        now_(now),
        world_from_then_(then.view.camera.camera_from_world.inverse()),
        partners_(partners(then.solids, now.solids)),
        b1_(from.width),
        b2_(from.width),
        height_mm_(from.width),
        was_(from.width),
        is_(from.width) {}

  void land(int y, LandedRow& row) {
    row.x.fill(kNowhere);
    row.first = row.last = 0;
    if (y < 0 || y >= from_.height) return;
    const std::uint8_t* const label = &from_.label[std::size_t(y) * from_.width];
    std::copy_n(label, from_.width, &row.label[0]);
    row.last = from_.width;
    while (row.last > 0 && label[row.last - 1] == 0) --row.last;
    while (row.first < row.last && label[row.first] == 0) ++row.first;
    place_skin(y, row);
    if (!from_.solid.empty()) place_solids(y, row);
    const int first = row.first;
    const auto count = static_cast<unsigned>(row.last - first);
    project_points(lens_of(now_.view), &row.label[first], &is_.x[first], &is_.y[first],
                   &is_.z[first], count, &row.x[first], &row.y[first]);
    project_points(lens_of(then_.view), &row.label[first], &was_.x[first], &was_.y[first],
                   &was_.z[first], count, &row.own_x[first], &row.own_y[first]);
    std::copy_n(&is_.z[first], count, &row.depth_mm[first]);
  }

 private:
  void place_skin(int y, const LandedRow& row) {
    const std::size_t begin = std::size_t(y) * from_.width;
    const BoundPixel* const bound = &from_.bound[begin];
    for (int i = row.first; i < row.last; ++i)
      b1_[i] = bound[i].b1, b2_[i] = bound[i].b2, height_mm_[i] = bound[i].height_mm;
    const auto is_skin = [&](int i) { return row.label[i] != 0 && from_.solid_at(begin + i) == 0; };
    for (int i = row.first, next; i < row.last; i = next) {
      next = i + 1;
      if (!is_skin(i)) continue;
      const std::uint32_t face = bound[i].face;
      while (next < row.last && bound[next].face == face && row.label[next] == row.label[i] &&
             is_skin(next))
        ++next;
      const std::size_t organ = from_.organ_at(begin + i);
      place_run(then_.skins[organ].shell[face], i, next, was_);
      place_run(now_.skins[organ].shell[face], i, next, is_);
    }
  }
  void place_run(const Moment::Columns& face, int first, int last, RowPoints& to) const {
    float* const planes[] = {&to.x[first], &to.y[first], &to.z[first]};
    for (int axis = 0; axis < 3; ++axis)
      place_points(face.data() + axis, &b1_[first], &b2_[first], &height_mm_[first],
                   static_cast<unsigned>(last - first), planes[axis]);
  }

  void place_solids(int y, const LandedRow& row) {
    const Intrinsics& k = then_.view.camera.intrinsics;
    for (int i = row.first; i < row.last; ++i) {
      const std::size_t pixel = std::size_t(y) * from_.width + i, solid = from_.solid_at(pixel);
      if (solid == 0) continue;
      const Vector3f point =
          (from_.depth_mm[pixel] * unproject(k, {i + 0.5, y + 0.5})).cast<float>();
      was_.put(i, point);
      is_.put(i, moved(world_from_then_ * point.cast<double>(), solid - 1));
    }
  }
  Vector3f moved(const Eigen::Vector3d& point, std::size_t solid) const {
    if (partners_[solid] < 0) return Vector3f::Constant(kNowhere);
    const Solid &was = then_.solids[solid], &is = now_.solids[partners_[solid]];
    return (now_.view.camera.camera_from_world * (point + shift_of(point, was, is))).cast<float>();
  }

  const PixelTruth& from_;
  const Moment &then_, &now_;
  RigidTransform world_from_then_;
  std::vector<int> partners_;
  Row<float> b1_, b2_, height_mm_;
  RowPoints was_, is_;
};

class Visibility {
 public:
  Visibility(const PixelTruth& from, const PixelTruth& to, const Moment& now)
      : from_(from),
        now_(now),
        shown_{to.depth_mm.data(), to.width, to.height, 1 / lens_of(now.view).fx} {}

  // Of the points of row y, by those beside them.
  void find(int y, const LandedRow& above, const LandedRow& row, const LandedRow& below,
            std::uint8_t* seen) const {
    std::fill_n(seen, from_.width, std::uint8_t{0});
    std::array<std::int32_t, kFlowSpan> answers;
    constexpr int kSpan = kFlowSpan;
    for (int first = row.first; first < row.last; first += kSpan) {
      const int count = std::min(kSpan, row.last - first);
      find_seen(shown_, above.at(first), row.at(first), below.at(first), &row.depth_mm[first],
                static_cast<unsigned>(count), answers.data());
      for (int i = 0; i < count; ++i) {
        const std::int32_t answer = answers[static_cast<std::size_t>(i)];
        seen[first + i] = answer == kFlowSeen ||
                          (answer != kFlowHidden && look_closely(answer, first + i, y, row));
      }
    }
  }

 private:
  bool look_closely(std::int32_t answer, int x, int y, const LandedRow& row) const {
    const std::size_t at = std::size_t(y) * from_.width + x;
    // Solids are turned to the eye as far as their axis tells.
    if ((answer & kFlowMayTurnAway) && from_.solid_at(at) == 0 &&
        !now_.faces_eye(from_.organ_at(at), from_.bound[at]))
      return false;
    return !(answer & kFlowBesideOutline) || before_neighbours(row.x[x], row.y[x], row.depth_mm[x]);
  }
  // Beside the outline a point may lie in a pixel whose centre shows nothing: then what it is
  // nearest to decides.
  bool before_neighbours(float px, float py, float depth_mm) const {
    const int x = static_cast<int>(px), y = static_cast<int>(py);
    const int aside = px - static_cast<float>(x) < 0.5f ? x - 1 : x + 1,
              beside = py - static_cast<float>(y) < 0.5f ? y - 1 : y + 1;
    const auto before = [&](int at_x, int at_y) {
      return shown_.holds(at_x, at_y) && shown_.before(px, py, depth_mm, at_x, at_y);
    };
    return before(aside, y) || before(x, beside) || before(aside, beside);
  }

  const PixelTruth& from_;
  const Moment& now_;
  ShownDepth shown_;
};

}  // namespace

void find_flow(const PixelTruth& from, const Moment& then, const PixelTruth& to, const Moment& now,
               Flow& flow) {
  flow.px.resize(from.pixels());
  flow.seen.resize(from.pixels());
  constexpr int kRows = 32;
  parallel_pieces(0, from.height, kRows, [&](int first, int last) {
    RowMover mover(from, then, now);
    const Visibility visibility(from, to, now);
    LandedRow above(from.width), row(from.width), below(from.width);
    mover.land(first - 1, row);
    mover.land(first, below);
    for (int y = first; y < last; ++y) {
      std::swap(above, row);
      std::swap(row, below);
      mover.land(y + 1, below);
      Eigen::Vector2f* const px = &flow.px[std::size_t(y) * from.width];
      std::fill_n(px, from.width, Eigen::Vector2f(0, 0));
      subtract_places(&row.x[row.first], &row.y[row.first], &row.own_x[row.first],
                      &row.own_y[row.first], static_cast<unsigned>(row.last - row.first),
                      px[row.first].data());
      visibility.find(y, above, row, below, &flow.seen[std::size_t(y) * from.width]);
    }
  });
}

}  // namespace organbake
