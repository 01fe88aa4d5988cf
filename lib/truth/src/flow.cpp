// SPDX-License-Identifier: Apache-2.0
#include "organbake/truth/flow.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

struct Lens {
  explicit Lens(const View& view)
      : fx(static_cast<float>(view.camera.intrinsics.fx)),
        fy(static_cast<float>(view.camera.intrinsics.fy)),
        cx(static_cast<float>(view.camera.intrinsics.cx)),
        cy(static_cast<float>(view.camera.intrinsics.cy)),
        near(static_cast<float>(view.near_mm)) {}
  Vector2f project(const Vector3f& p) const {
    const float inverse = 1 / p.z();
    return {fx * p.x() * inverse + cx, fy * p.y() * inverse + cy};
  }
  float fx, fy, cx, cy, near;
};

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
    Eigen::Matrix<double, 3, 2> sides;
    sides << axis, *was.corner - was.from;
    const Eigen::Vector2d b = sides.colPivHouseholderQr().solve(point - was.from);
    return (1 - b.sum()) * (is.from - was.from) + b.x() * (is.to - was.to) +
           b.y() * (*is.corner - *was.corner);
  }
  const double along =
      length2 > 0 ? std::clamp((point - was.from).dot(axis) / length2, 0.0, 1.0) : 0;
  return (1 - along) * (is.from - was.from) + along * (is.to - was.to);
}

class Mover {
 public:
  Mover(const PixelTruth& from, const Moment& then, const Moment& now)
      : from_(from),
        then_(then),
        now_(now),
        world_from_then_(then.view.camera.camera_from_world.inverse()),
        partners_(partners(then.solids, now.solids)) {}

  // Camera mm of the other moment.
  std::optional<Vector3f> moved(std::size_t pixel) const {
    const std::size_t solid = from_.solid_at(pixel);
    if (solid == 0) return now_.place(from_.organ_at(pixel), from_.bound[pixel]);
    if (partners_[solid - 1] < 0) return std::nullopt;
    const Solid &was = then_.solids[solid - 1], &is = now_.solids[partners_[solid - 1]];
    const Eigen::Vector3d point = world_from_then_ * from_.point[pixel].cast<double>();
    return (now_.view.camera.camera_from_world * (point + shift_of(point, was, is))).cast<float>();
  }

 private:
  const PixelTruth& from_;
  const Moment &then_, &now_;
  RigidTransform world_from_then_;
  std::vector<int> partners_;
};

constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();

// Where the points of one picture land in the other: px and depth; not a number: nowhere.
struct Landing {
  std::vector<Vector2f> px;
  std::vector<float> depth_mm;
};

class Visibility {
 public:
  Visibility(const PixelTruth& from, const PixelTruth& to, const Moment& now,
             const Landing& landing)
      : from_(from), to_(to), now_(now), lens_(now.view), landing_(landing) {}

  bool seen(int x, int y) const {
    const std::size_t at = std::size_t(y) * from_.width + x;
    const Vector2f& px = landing_.px[at];
    if (!(px.x() >= 0 && px.y() >= 0 && px.x() < static_cast<float>(to_.width) &&
          px.y() < static_cast<float>(to_.height)))
      return false;
    return turned_to_eye(x, y) && !hidden(px, landing_.depth_mm[at]);
  }

 private:
  // From one neighbour to the other, of those that show the same; zero where there is none.
  Vector2f across(std::size_t at, int place, int size, std::size_t step) const {
    const auto goes_on = [&](std::size_t other) {
      return from_.label[other] == from_.label[at] && !std::isnan(landing_.px[other].x());
    };
    const std::size_t before = place > 0 && goes_on(at - step) ? at - step : at,
                      after = place + 1 < size && goes_on(at + step) ? at + step : at;
    return landing_.px[after] - landing_.px[before];
  }
  // Skin that turns away arrives mirrored; what arrives squeezed is looked at closely.
  bool turned_to_eye(int x, int y) const {
    const std::size_t at = std::size_t(y) * from_.width + x;
    if (from_.solid_at(at) != 0) return true;  // as far as its axis tells
    constexpr float kSqueezed = 0.5f;
    const Vector2f right = across(at, x, from_.width, 1),
                   down = across(at, y, from_.height, from_.width);
    const bool whole = right.x() * down.y() - right.y() * down.x() > 4 * kSqueezed;
    return whole || now_.faces_eye(from_.organ_at(at), from_.bound[at]);
  }
  // How the other picture's depth goes on from a pixel towards one side: by the pixel there, or,
  // where the skin ends or hides other skin, as it came from the other side; and how surely.
  struct Rise {
    float mm, tolerance_mm;
  };
  Rise rise(std::size_t at, int place, int size, std::ptrdiff_t step, bool on) const {
    const auto to = [&](bool after) {
      if (after ? place + 1 >= size : place == 0) return kNowhere;
      return to_.depth_mm[at + (after ? step : -step)] - to_.depth_mm[at];
    };
    const float there = to(on), back = to(!on);
    constexpr float kBreak = 4;
    const float pixel_mm = to_.depth_mm[at] / lens_.fx;
    const bool breaks =
        !std::isfinite(there) || std::abs(there) > kBreak * std::abs(back) + kBreak * pixel_mm;
    constexpr float kBend = 0.35f, kOutline = 1.2f;  // of a slope, within a pixel
    if (!breaks) return {there, kBend * std::abs(there)};
    const float slope = std::isfinite(back) ? std::abs(back) : 0;
    return {std::isfinite(back) ? -back : 0, kOutline * slope};
  }
  // Whether a point that lies at px lies on or before what a pixel near by shows.
  bool before(const Vector2f& px, float depth_mm, int x, int y) const {
    if (x < 0 || y < 0 || x >= to_.width || y >= to_.height) return false;
    const std::size_t at = std::size_t(y) * to_.width + x;
    const float shown = to_.depth_mm[at];
    if (!std::isfinite(shown)) return false;
    const float u = px.x() - (static_cast<float>(x) + 0.5f),
                v = px.y() - (static_cast<float>(y) + 0.5f);
    const Rise across = rise(at, x, to_.width, 1, u > 0),
               down = rise(at, y, to_.height, to_.width, v > 0);
    return depth_mm <= shown + std::abs(u) * across.mm + std::abs(v) * down.mm +
                           across.tolerance_mm + down.tolerance_mm + 0.5f * shown / lens_.fx;
  }
  // Whether the other picture's pixel there shows something nearer. Beside the outline a point may
  // lie in a pixel whose centre shows nothing: then what it is nearest to decides.
  bool hidden(const Vector2f& px, float depth_mm) const {
    const int x = static_cast<int>(px.x()), y = static_cast<int>(px.y());
    if (std::isfinite(to_.depth_mm[std::size_t(y) * to_.width + x]))
      return !before(px, depth_mm, x, y);
    const int aside = px.x() - static_cast<float>(x) < 0.5f ? x - 1 : x + 1,
              beside = px.y() - static_cast<float>(y) < 0.5f ? y - 1 : y + 1;
    return !before(px, depth_mm, aside, y) && !before(px, depth_mm, x, beside) &&
           !before(px, depth_mm, aside, beside);
  }

  const PixelTruth &from_, &to_;
  const Moment& now_;
  Lens lens_;
  const Landing& landing_;
};

}  // namespace

void find_flow(const PixelTruth& from, const Moment& then, const PixelTruth& to, const Moment& now,
               Flow& flow) {
  const Mover mover(from, then, now);
  const Lens here(then.view), there(now.view);
  const std::size_t pixels = from.pixels();
  thread_local Landing landing;  // kept for its memory
  landing.px.resize(pixels);
  landing.depth_mm.resize(pixels);
  flow.px.resize(pixels);
  flow.seen.resize(pixels);
  Landing& landed = landing;  // this thread's, seen by the others
  constexpr std::size_t kGrain = 1 << 13;
  parallel_pieces(std::size_t{0}, pixels, kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      flow.px[i].setZero();
      landed.px[i].setConstant(kNowhere);
      if (from.label[i] == 0) continue;
      const auto moved = mover.moved(i);
      if (!moved || !(moved->z() > there.near)) continue;
      landed.px[i] = there.project(*moved);
      landed.depth_mm[i] = moved->z();
      flow.px[i] = landed.px[i] - here.project(from.point[i]);
    }
  });
  const Visibility visibility(from, to, now, landed);
  parallel_for(0, from.height, [&](int y) {
    for (int x = 0; x < from.width; ++x)
      flow.seen[std::size_t(y) * from.width + x] = visibility.seen(x, y);
  });
}

}  // namespace organbake
