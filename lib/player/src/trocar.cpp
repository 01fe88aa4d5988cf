// SPDX-License-Identifier: Apache-2.0
// A laparoscopic instrument turns about its trocar, where it passes the abdominal wall. A script of
// old names none, so one is found: of 256 places on a sphere round the tool's way (a Fibonacci
// spiral), each gets a price for all that makes a shaft look wrong, at every moment, and the
// cheapest is taken. A shaft that passes through tissue at any moment is dearer than all else
// together. What the shaft meets takes long to ask, so that it is asked of the places in the order
// of the rest of their price, until no later one can be cheaper.
//
// A shaft of length D whose tool stays within S of a place turns by less than 2·asin(S/D) between
// any two moments: with D ≥ 4 S, by less than 29°.
#include "trocar.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "organbake/geometry/mesh_checks.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr int kPlaces = 256;
constexpr double kLengths = 4;        // of the tool's way from its middle, and of its distance
constexpr double kExtents = 1.2;      // of the organs, where the tool stays where it is
constexpr double kClear_mm = 4;       // round the shaft's axis
constexpr double kDimpleShare = 2.5;  // a pressed skin's dimple is so much wider than deep

double degrees(double cosine) {
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
}
double squared(double x) { return x * x; }
// By how much x lies beyond a bound, in units of `scale`, squared.
double beyond(double x, double bound, double scale) {
  return squared(std::max(0.0, x - bound) / scale);
}

Vector3d place_on_sphere(int i) {
  const double z = 1 - (2 * i + 1.0) / kPlaces, r = std::sqrt(1 - z * z);
  const double turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
  return {r * std::cos(turn), r * std::sin(turn), z};
}

// How near two segments come, by trying places along the one.
double distance_between(const TrocarChooser::Shaft& a, const TrocarChooser::Shaft& b) {
  constexpr int kTried = 16;
  const Vector3d along = b[1] - b[0];
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kTried; ++i) {
    const Vector3d at = a[0] + double(i) / kTried * (a[1] - a[0]);
    const double t = std::clamp((at - b[0]).dot(along) / along.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (b[0] + t * along - at).norm());
  }
  return nearest;
}

}  // namespace

// One moment as the search sees it.
struct TrocarChooser::Sight {
  Vector3d joint;    // where the shaft begins
  Vector3d outward;  // of the skin there, to the side that the tool came from, unit
  Vector3d axis;     // of a tool that has one, unit; else zero
  Vector3d to_eye;   // unit
  Vector3d up;       // of the picture, unit
  Vector3d eye;
  double dimple_mm;  // as far from the joint skin may lie that the tool itself presses in
  bool pressed_in;   // below the skin, at rest: a shaft that goes on inward comes through tissue
};

class TrocarChooser::Scene {
 public:
  Scene(const TrocarChooser& organs, const std::vector<ToolMoment>& moments) : organs_(organs) {
    // Where a tool of one moment came from nothing tells: it may be pressed in as deep as it is.
    // One with an axis comes from where that ends, be its tip before the sheet or behind it.
    const Instrument& first = moments.front().tool;
    side_ = moments.size() > 1 && is_clear_behind(first.end_mm(), first.radius_mm) ? -1 : 1;
    for (const ToolMoment& moment : moments) sights_.push_back(sight(moment));
  }

  const std::vector<Sight>& sights() const { return sights_; }

  // All but what the shaft meets; the mean of the moments'.
  double price(const Vector3d& trocar, const std::vector<Shaft>& others) const {
    double sum = 0;
    for (const Sight& s : sights_) sum += price_at(s, trocar, others);
    return sum / static_cast<double>(sights_.size());
  }
  // As far as it is not beyond `most`.
  double price_of_meeting(const Vector3d& trocar, double most) const {
    constexpr double kMeets = 1e4;
    double price = 0;
    for (const Sight& s : sights_) {
      if (price > most) break;
      if (meets_skin(s, trocar)) price += kMeets / static_cast<double>(sights_.size());
    }
    return price;
  }

 private:
  std::size_t nearest_to(const Vector3d& place) const {
    const std::vector<Vector3d>& skin = organs_.skin_.vertices;
    return std::min_element(skin.begin(), skin.end(),
                            [&](const Vector3d& a, const Vector3d& b) {
                              return (a - place).squaredNorm() < (b - place).squaredNorm();
                            }) -
           skin.begin();
  }
  // Whether a joint lies behind an open sheet and does not touch it. Inside a closed skin there is
  // tissue, whose tools were pressed in from outside.
  bool is_clear_behind(const Vector3d& joint, double radius_mm) const {
    const std::size_t near = nearest_to(joint);
    const Vector3d from_joint = organs_.skin_.vertices[near] - joint;
    return organs_.open_[near] && from_joint.dot(organs_.normals_[near]) > radius_mm;
  }
  Sight sight(const ToolMoment& moment) const {
    const Instrument& tool = moment.tool;
    Sight s;
    s.joint = tool.end_mm();
    s.axis = tool.axis_mm.stableNormalized();
    s.eye = moment.view.camera.center_world_mm();
    s.to_eye = (s.eye - s.joint).stableNormalized();
    s.up = -moment.view.camera.camera_from_world.rotation.row(1).transpose();
    const std::size_t near = nearest_to(tool.position_mm);
    s.outward = side_ * organs_.normals_[near];
    const double depth =
        std::max(0.0, (organs_.skin_.vertices[near] - tool.position_mm).dot(s.outward));
    s.dimple_mm = tool.is_blunt() ? kDimpleShare * depth + 2 * tool.radius_mm : 0;
    s.pressed_in = tool.is_blunt() && depth > 0;
    return s;
  }

  double price_at(const Sight& s, const Vector3d& trocar, const std::vector<Shaft>& others) const {
    const Vector3d shaft = (trocar - s.joint).normalized();
    double sum = squared(degrees(shaft.dot(s.outward)) / 70) +
                 3 * beyond(degrees(shaft.dot(s.outward)), 65, 20);
    const double to_eye = degrees(shaft.dot(s.to_eye));
    sum += 4 * beyond(-to_eye, -40, 20) + 3 * beyond(to_eye, 100, 30);
    // From below and from the side, as a surgeon's hands are.
    const Vector3d right = s.up.cross(s.to_eye);
    sum += 0.4 * (1 + shaft.dot(s.up)) + 0.3 * (1 - std::abs(shaft.dot(right)));
    if (!s.axis.isZero(0)) sum += 2 * squared(degrees(shaft.dot(s.axis)) / 60);
    const Shaft whole = {s.joint, trocar};
    const double eye_mm = (s.eye - s.joint).norm();
    sum += 6 * (distance_between(whole, {s.eye, s.eye + 1e-3 * s.to_eye}) < 0.15 * eye_mm);
    for (const Shaft& other : others) sum += 3 * (distance_between(whole, other) < 2 * kClear_mm);
    return sum;
  }

  // Whether the shaft, thick as it is, passes skin beyond what its tool presses in.
  bool meets_skin(const Sight& s, const Vector3d& trocar) const {
    const Vector3d along = (trocar - s.joint).normalized();
    if (s.pressed_in && along.dot(s.outward) <= 0) return true;
    const Vector3d aside = kClear_mm * along.unitOrthogonal(), other = along.cross(aside);
    for (const Vector3d& off : {Vector3d(0, 0, 0), Vector3d(aside), Vector3d(other),
                                Vector3d(-aside), Vector3d(-other)}) {
      const double from = off.isZero(0) ? s.dimple_mm : std::max(s.dimple_mm, 2 * kClear_mm);
      if (meets_line(s.joint + off, along, from, (trocar - s.joint).norm())) return true;
    }
    return false;
  }
  bool meets_line(const Vector3d& from, const Vector3d& along, double least, double most) const {
    const std::vector<Vector3d>& at = organs_.skin_.vertices;
    return std::any_of(organs_.skin_.faces.begin(), organs_.skin_.faces.end(), [&](const Face& f) {
      const auto t = line_crossing(from, along, at[f[0]], at[f[1]], at[f[2]]);
      return t && *t > least && *t < most;
    });
  }

  const TrocarChooser& organs_;
  double side_;  // of the skin that the tool came from: 1 outside, -1 behind an open sheet
  std::vector<Sight> sights_;
};

TrocarChooser::TrocarChooser(const std::vector<const Bundle*>& organs) {
  for (const Bundle* organ : organs) {
    const TriangleMesh skin = organ->shell().at_rest();
    const std::vector<Vector3d> normals = vertex_normals(skin);
    const auto first = static_cast<std::uint32_t>(skin_.vertices.size());
    for (const Face& f : skin.faces)
      skin_.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
    skin_.vertices.insert(skin_.vertices.end(), skin.vertices.begin(), skin.vertices.end());
    normals_.insert(normals_.end(), normals.begin(), normals.end());
    open_.resize(normals_.size(), analyse_topology(skin).boundary_edges > 0);
    extent_mm_ = std::max(extent_mm_, bounds(skin).diagonal());
  }
}

Vector3d TrocarChooser::choose(const std::vector<ToolMoment>& moments,
                               const std::vector<Shaft>& others_mm) const {
  const Scene scene(*this, moments);
  Bounds way;
  for (const Sight& s : scene.sights()) way.add(s.joint);
  double far_mm = 0;
  for (const Sight& s : scene.sights()) far_mm = std::max(far_mm, (s.joint - way.center()).norm());
  const double length_mm = std::max(kExtents * extent_mm_, kLengths * far_mm);
  std::vector<std::pair<double, int>> places;
  const auto trocar_at = [&](int i) -> Vector3d {
    return way.center() + length_mm * place_on_sphere(i);
  };
  for (int i = 0; i < kPlaces; ++i) places.emplace_back(scene.price(trocar_at(i), others_mm), i);
  std::sort(places.begin(), places.end());
  double cheapest = std::numeric_limits<double>::infinity();
  int best = 0;
  for (const auto& [price, place] : places) {
    if (price >= cheapest) break;
    const double whole = price + scene.price_of_meeting(trocar_at(place), cheapest - price);
    if (whole < cheapest) cheapest = whole, best = place;
  }
  return trocar_at(best);
}

}  // namespace organbake
