// SPDX-License-Identifier: Apache-2.0
// The camera on an orbit about an organ, by angles from virtual camera 0. It stops just short of
// the poles, where the azimuth would lose its meaning. And says why a picture is empty: the eye is
// inside an organ, by the winding number of its proxy (solid angles; van Oosterom & Strackee 1983),
// or the lens touches skin that is too near to be drawn.
#include "organbake/player/orbit.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/refine.h"
#include "organbake/player/player.h"

namespace organbake {
namespace {

void check(const OrbitPose& pose, int width, int height) {
  if (width < 1 || height < 1) {
    throw UsageError("a picture of " + std::to_string(width) + "×" + std::to_string(height) +
                     " has no pixels");
  }
  for (const double value :
       {pose.azimuth_rad, pose.elevation_rad, pose.roll_rad, pose.right, pose.up}) {
    if (!std::isfinite(value)) throw UsageError("a view's angles and shifts must be finite");
  }
  if (!(pose.distance > 0 && pose.distance < kFarthestDistance)) {
    throw UsageError(
        "a view's distance is " + to_text(pose.distance) +
        "; it must lie above 0 and below a million times the virtual cameras' distance");
  }
}

// Just short of the poles, where the azimuth would lose its meaning.
constexpr double kPole_rad = 0.5 * std::numbers::pi - 1e-3;

// Axes in which z is up; the world's own, or a scope's, whose first camera looks along z.
Eigen::Matrix3d upright_from_world(const Eigen::Vector3d& up) {
  Eigen::Matrix3d upright = Eigen::Matrix3d::Identity();
  if (up.z() != 1) upright << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return upright;
}

Eigen::Vector3d eye_from_center(const CameraSet& cameras) {
  return cameras.cameras.front().center_world_mm() - cameras.manifold.center_world_mm;
}

// The eye's elevation above the horizon.
double elevation_rad(const Eigen::Vector3d& to_eye_upright, const OrbitPose& pose) {
  return std::asin(std::clamp(to_eye_upright.z() / to_eye_upright.norm(), -1.0, 1.0)) +
         pose.elevation_rad;
}

}  // namespace

bool leads_past_pole(const CameraSet& cameras, const OrbitPose& pose) {
  constexpr double kBarely_rad = 2e-3;
  const Eigen::Vector3d to_eye = eye_from_center(cameras);
  return std::abs(elevation_rad(upright_from_world(up_from(to_eye)) * to_eye, pose)) >
         kPole_rad + kBarely_rad;
}

View orbit_view(const CameraSet& cameras, const OrbitPose& pose, int width, int height) {
  check(pose, width, height);
  const PosedCamera& first = cameras.cameras.front();
  const Eigen::Vector3d center = cameras.manifold.center_world_mm;
  const Eigen::Vector3d world_to_eye = eye_from_center(cameras), up = up_from(world_to_eye);
  const Eigen::Matrix3d upright = upright_from_world(up);
  const Eigen::Vector3d to_eye = upright * world_to_eye;
  const double azimuth = std::atan2(to_eye.y(), to_eye.x()) + pose.azimuth_rad;
  const double elevation = std::clamp(elevation_rad(to_eye, pose), -kPole_rad, kPole_rad);
  const Eigen::Vector3d direction =
      upright.transpose() * Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                                            std::cos(elevation) * std::sin(azimuth),
                                            std::sin(elevation));
  View view;
  view.camera.name = "viewer";
  const double focal = first.intrinsics.fx * std::min(width, height) /
                       std::min(first.intrinsics.width, first.intrinsics.height);
  view.camera.intrinsics = {width, height, focal, focal, 0.5 * width, 0.5 * height};
  view.camera.camera_from_world =
      look_at(center + pose.distance * to_eye.norm() * direction, center, up);
  const RigidTransform roll = {
      Eigen::AngleAxisd(pose.roll_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
      Eigen::Vector3d::Zero()};
  view.camera.camera_from_world = roll * view.camera.camera_from_world;
  view.camera.camera_from_world.translation +=
      to_eye.norm() * Eigen::Vector3d(-pose.right, pose.up, 0);
  return view;
}

// A pose of the orbit that frames several organs: the eye is moved to the middle of what it sees
// and to the distance that fills the picture, again and again, since perspective changes both.
namespace {

constexpr double kFilled = 0.9;  // of the picture's side
constexpr int kRounds = 12;  // each moves the eye into the middle and back: far more than enough

// Where the organs lie in a picture: from −1 to 1 across each side, and how far on the average.
struct Extent {
  Eigen::AlignedBox2d box;
  double mean_depth_mm = 0;
};
Extent extent_in(const View& view, const Player& player) {
  const Intrinsics& lens = view.camera.intrinsics;
  Extent extent;
  double count = 0;
  for (std::size_t o = 0; o < player.organ_count(); ++o) {
    for (const Eigen::Vector3d& vertex : player.bundle(o).proxy.vertices) {
      Eigen::Vector3d at = view.camera.camera_from_world * vertex;
      at.z() = std::max(at.z(), view.near_mm);
      extent.mean_depth_mm += at.z();
      ++count;
      extent.box.extend(Eigen::Vector2d(2 * lens.fx / lens.width * at.head<2>() / at.z()));
    }
  }
  extent.mean_depth_mm /= count;
  return extent;
}

}  // namespace

OrbitPose framing_pose(const Player& player) {
  OrbitPose pose;
  if (player.organ_count() == 1) return pose;
  const CameraSet& cameras = player.bundle().cameras;
  const double unit_mm =
      (cameras.cameras.front().center_world_mm() - cameras.manifold.center_world_mm).norm();
  constexpr int kSide = 100;
  for (int round = 0; round < kRounds; ++round) {
    const View view = orbit_view(cameras, pose, kSide, kSide);
    const Extent extent = extent_in(view, player);
    const Eigen::Vector2d middle = extent.box.center();
    // In multiples of the virtual cameras' distance: of the organs, and half a picture there.
    const double depth = extent.mean_depth_mm / unit_mm;
    const double half = 0.5 * kSide * depth / view.camera.intrinsics.fx;
    pose.right += half * middle.x();
    pose.up -= half * middle.y();
    const double nearer = extent.box.sizes().maxCoeff() / (2 * kFilled);
    pose.distance = std::max(pose.distance + (nearer - 1) * depth, 0.1 * pose.distance);
  }
  return pose;
}

bool eye_is_inside(const Player& player, const View& view) {
  const Eigen::Vector3d eye = view.camera.center_world_mm();
  constexpr double kSurelyInside = 0.75;  // of a whole turn; beside an open sheet it is half of one
  for (std::size_t o = 0; o < player.organ_count(); ++o) {
    const std::vector<Eigen::Vector3d>& at = player.proxy_positions(o);
    double turns = 0;
    for (const auto& [i, j, k] : player.bundle_now(o).proxy.faces) {
      const Eigen::Vector3d a = at[i] - eye, b = at[j] - eye, c = at[k] - eye;
      const double la = a.norm(), lb = b.norm(), lc = c.norm();
      turns += std::atan2(a.dot(b.cross(c)),
                          la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    if (turns / (2 * std::numbers::pi) > kSurelyInside) return true;
  }
  return false;
}

namespace {

// How far the relief stands over a face of the skin at most, mm; as the base layer tells it.
double relief_mm(const BaseLayer& base, std::size_t face) {
  const std::size_t nodes = base.face_count == 0 ? 0 : base.nodes_per_face();
  double highest = 0;
  for (std::size_t n = face * nodes; n < std::min((face + 1) * nodes, base.height_mm.size()); ++n)
    highest = std::max(highest, double(base.height_mm[n]));
  return highest;
}

// Whether some skin lies nearer to the eye than it can be drawn.
bool lens_touches_skin(const Player& player, const View& view) {
  const Eigen::Vector3d eye = view.camera.center_world_mm();
  // Skin is drawn from the near plane on, which is farther away at the picture's corners.
  const double reach_mm = 2 * view.near_mm;
  for (std::size_t o = 0; o < player.organ_count(); ++o) {
    const Bundle& now = player.bundle_now(o);
    const TriangleMesh skin = now.shell().posed(player.proxy_positions(o));
    for (std::size_t f = 0; f < skin.faces.size(); ++f) {
      const auto& [i, j, k] = skin.faces[f];
      const Eigen::Vector3d &a = skin.vertices[i], &b = skin.vertices[j], &c = skin.vertices[k];
      const Eigen::Vector3d weights = nearest_on_triangle(eye, a, b, c);
      const Eigen::Vector3d nearest = weights[0] * a + weights[1] * b + weights[2] * c;
      if ((nearest - eye).norm() < reach_mm + relief_mm(now.base, f)) return true;
    }
  }
  return false;
}

}  // namespace

std::optional<std::string> why_empty(const Player& player, const View& view,
                                     const DrawReport& report) {
  if (report.unchanged || report.sample_pixels + report.base_pixels > 0) return std::nullopt;
  const std::string go_back =
      ": go back, or leave at least " + to_text(kNearest_mm) + " mm between the lens and the skin";
  if (eye_is_inside(player, view))
    return "the eye is inside the organ, whose skin is seen from outside alone" + go_back;
  if (lens_touches_skin(player, view)) return "the lens touches the skin" + go_back;
  return std::nullopt;
}

}  // namespace organbake
