// SPDX-License-Identifier: Apache-2.0
// A tool that a mouse or a finger moves: from where it was put onto the skin and how far it was
// dragged in the picture follow its place, its depth and, of scissors, the opening.
#include "organbake/player/pointer_tool.h"

#include <algorithm>
#include <variant>

namespace organbake {
namespace {

constexpr double kCutDepth_mm = 8, kBlade_mm = 40, kBladeRadius_mm = 0.4;
constexpr double kNeedle_mm = 60, kNeedleRadius_mm = 0.6;
constexpr double kSnipDepth_mm = 6, kScissors_mm = 24, kScissorsRadius_mm = 0.8;
constexpr double kWidestOpening_mm = 20;
constexpr double kLeastDrag_mm = 1;  // shorter ones have no direction yet

}  // namespace

PointerTool::PointerTool(const View& touched, const Eigen::Vector2d& at_px, double skin_depth_mm)
    : touched_(touched), touched_px_(at_px), pointer_px_(at_px) {
  const RigidTransform world_from_camera = touched.camera.camera_from_world.inverse();
  const Eigen::Vector3d ray = unproject(touched.camera.intrinsics, at_px);
  touched_mm_ = world_from_camera * Eigen::Vector3d(skin_depth_mm * ray);
  sight_ = (world_from_camera.rotation * ray).normalized();
  opens_along_ = world_from_camera.rotation.col(0);
}

Instrument PointerTool::tool(const InstrumentKind& kind, double radius_mm) const {
  Instrument tool{touched_mm_, radius_mm, kind, true};
  double length_mm = 0;
  if (tool.is<Blade>()) tool.radius_mm = kBladeRadius_mm, length_mm = kBlade_mm;
  if (tool.is<Needle>()) tool.radius_mm = kNeedleRadius_mm, length_mm = kNeedle_mm;
  if (tool.is<Scissors>()) tool.radius_mm = kScissorsRadius_mm, length_mm = kScissors_mm;
  tool.axis_mm = -length_mm * sight_;
  return tool;
}

void PointerTool::move(Instrument& tool) {
  tool.position_mm = position_mm(tool);
  depth_mm_ = (tool.position_mm - touched_mm_).dot(sight_) + tool.radius_mm;
  if (Scissors* scissors = std::get_if<Scissors>(&tool.kind)) open(*scissors);
}

// How far the pointer has moved across the view, at the depth of the place touched; world.
Eigen::Vector3d PointerTool::dragged_mm() const {
  const RigidTransform& camera_from_world = touched_.camera.camera_from_world;
  const double z = (camera_from_world * touched_mm_).z();
  const Eigen::Vector2d moved_mm = z / touched_.camera.intrinsics.fx * (pointer_px_ - touched_px_);
  return camera_from_world.rotation.transpose() * Eigen::Vector3d(moved_mm.x(), moved_mm.y(), 0);
}

// The ball touches the skin from the eye's side, and goes on from there.
Eigen::Vector3d PointerTool::position_mm(const Instrument& tool) const {
  const Eigen::Vector3d touching = touched_mm_ - tool.radius_mm * sight_;
  const Eigen::Vector3d dragged = dragged_mm();
  if (tool.is<Grasper>()) return touching + dragged + pushed_mm_ * sight_;
  if (tool.is<Blade>()) return touched_mm_ + dragged + (kCutDepth_mm + pushed_mm_) * sight_;
  if (tool.is<Scissors>()) return touched_mm_ + (kSnipDepth_mm + pushed_mm_) * sight_;
  return touching + (dragged.norm() + pushed_mm_) * sight_;
}

// Along the drag as it began, by twice its length: either blade goes with the pointer.
void PointerTool::open(Scissors& scissors) {
  const Eigen::Vector3d dragged = dragged_mm();
  if (opening_mm_ == 0 && dragged.norm() >= kLeastDrag_mm) opens_along_ = dragged;
  if (opening_mm_ > 0 || dragged.norm() >= kLeastDrag_mm)
    opening_mm_ = std::clamp(2 * dragged.dot(opens_along_.normalized()), 0.0, kWidestOpening_mm);
  scissors.opening_mm = opening_mm_ * opens_along_.normalized();
}

}  // namespace organbake
