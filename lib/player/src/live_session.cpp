// SPDX-License-Identifier: Apache-2.0
// Every step is recorded as waypoints of a script, from what the pointer asked for, not from where
// tools were held: played again, the same solver holds them off in the same way.
#include "organbake/player/live_session.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "organbake/core/stopwatch.h"

namespace organbake {
namespace {

constexpr double kTurnPerPicture_rad = std::numbers::pi;  // a drag across the smaller side
constexpr double kZoomPerStep = 0.9;
constexpr double kNearest = 0.35, kFarthest = 4;  // of the virtual cameras' distance
constexpr double kHighest_rad = 1.5;
constexpr double kCutDepth_mm = 8, kBlade_mm = 40, kBladeRadius_mm = 0.4;
constexpr double kNeedle_mm = 60, kNeedleRadius_mm = 0.6;
constexpr double kSnipDepth_mm = 6, kScissors_mm = 24, kScissorsRadius_mm = 0.8;
constexpr double kWidestOpening_mm = 20;
constexpr double kLeastDrag_mm = 1;  // shorter ones have no direction yet

double smaller_side(const View& view) {
  return std::min(view.camera.intrinsics.width, view.camera.intrinsics.height);
}

}  // namespace

LiveSession::LiveSession(Player& player, double time_step_s)
    : player_(&player),
      time_step_s_(time_step_s),
      tool_radius_mm_(player.bundle().mechanics.instrument_radius_mm),
      tools_(player),
      placed_tools_(player) {
  player.reset();
  view_ = orbit_view(player.bundle().cameras, pose_, 1, 1);
}

void LiveSession::turn(const Eigen::Vector2d& by_px) {
  const double rad_per_px = kTurnPerPicture_rad / smaller_side(view_);
  pose_.azimuth_rad -= rad_per_px * by_px.x();
  pose_.elevation_rad =
      std::clamp(pose_.elevation_rad + rad_per_px * by_px.y(), -kHighest_rad, kHighest_rad);
}

void LiveSession::shift(const Eigen::Vector2d& by_px) {
  // At the centre's distance a pixel is distance / focal length wide.
  const double per_px = pose_.distance / view_.camera.intrinsics.fx;
  pose_.right -= per_px * by_px.x();
  pose_.up += per_px * by_px.y();
}

void LiveSession::zoom(double steps) {
  pose_.distance = std::clamp(pose_.distance * std::pow(kZoomPerStep, steps), kNearest, kFarthest);
}

void LiveSession::face_front() { pose_ = {}; }

bool LiveSession::touch(const Eigen::Vector2d& at_px, const InstrumentKind& kind) {
  if (!find_touched(at_px)) return false;
  take_tool(kind);
  return true;
}

bool LiveSession::find_touched(const Eigen::Vector2d& at_px) {
  const Intrinsics& picture = view_.camera.intrinsics;
  const Eigen::Vector2i pixel = at_px.array().floor().cast<int>();
  if (pixel.x() < 0 || pixel.y() < 0 || pixel.x() >= picture.width || pixel.y() >= picture.height) {
    return false;
  }
  const std::size_t index = std::size_t(pixel.y()) * picture.width + pixel.x();
  if (index >= frame_.depth_mm.size() || !std::isfinite(frame_.depth_mm[index])) return false;
  const RigidTransform world_from_camera = view_.camera.camera_from_world.inverse();
  const Eigen::Vector3d ray = unproject(picture, at_px);
  touched_mm_ = world_from_camera * Eigen::Vector3d(double(frame_.depth_mm[index]) * ray);
  sight_ = (world_from_camera.rotation * ray).normalized();
  touched_px_ = pointer_px_ = at_px;
  touch_view_ = view_;
  return true;
}

void LiveSession::take_tool(const InstrumentKind& kind) {
  pushed_mm_ = opening_mm_ = 0;
  holding_ = true;
  Instrument tool{touched_mm_, tool_radius_mm_, kind, true};
  double length_mm = 0;
  if (tool.is<Blade>()) tool.radius_mm = kBladeRadius_mm, length_mm = kBlade_mm;
  if (tool.is<Needle>()) tool.radius_mm = kNeedleRadius_mm, length_mm = kNeedle_mm;
  if (tool.is<Scissors>()) tool.radius_mm = kScissorsRadius_mm, length_mm = kScissors_mm;
  if (Blade* blade = std::get_if<Blade>(&tool.kind)) blade->cut_width_mm = cut_width_mm_;
  tool.axis_mm = -length_mm * sight_;
  tips_.push_back(tool);
  const Eigen::Matrix3d world_from_camera = view_.camera.camera_from_world.inverse().rotation;
  InstrumentPath& record = tool_record_.emplace_back();
  record.name = mode_of(kind);
  record.instrument = tool;
  if (Scissors* scissors = std::get_if<Scissors>(&record.instrument.kind)) {
    scissors->opening_mm = world_from_camera.col(0);
  }
}

void LiveSession::drag(const Eigen::Vector2d& to_px) { pointer_px_ = to_px; }

void LiveSession::push(double mm) { pushed_mm_ += mm; }

// Across the view, at the depth of the place touched; world.
Eigen::Vector3d LiveSession::dragged_mm() const {
  const RigidTransform& camera_from_world = touch_view_.camera.camera_from_world;
  const double z = (camera_from_world * touched_mm_).z();
  const Eigen::Vector2d moved_mm =
      z / touch_view_.camera.intrinsics.fx * (pointer_px_ - touched_px_);
  return camera_from_world.rotation.transpose() * Eigen::Vector3d(moved_mm.x(), moved_mm.y(), 0);
}

// The ball touches the skin from the eye's side, and goes on from there.
Eigen::Vector3d LiveSession::tip_position_mm() const {
  const Eigen::Vector3d touching = touched_mm_ - tips_.back().radius_mm * sight_;
  const Eigen::Vector3d dragged = dragged_mm();
  const Instrument& tool = tips_.back();
  if (tool.is<Grasper>()) return touching + dragged + pushed_mm_ * sight_;
  if (tool.is<Blade>()) return touched_mm_ + dragged + (kCutDepth_mm + pushed_mm_) * sight_;
  if (tool.is<Scissors>()) return touched_mm_ + (kSnipDepth_mm + pushed_mm_) * sight_;
  return touching + (dragged.norm() + pushed_mm_) * sight_;
}

// Along the drag as it began, by twice its length: either blade goes with the pointer.
void LiveSession::open_scissors() {
  const Eigen::Vector3d dragged = dragged_mm();
  Eigen::Vector3d& along = std::get<Scissors>(tool_record_.back().instrument.kind).opening_mm;
  if (opening_mm_ == 0 && dragged.norm() >= kLeastDrag_mm) along = dragged;
  if (opening_mm_ > 0 || dragged.norm() >= kLeastDrag_mm)
    opening_mm_ = std::clamp(2 * dragged.dot(along.normalized()), 0.0, kWidestOpening_mm);
  std::get<Scissors>(tips_.back().kind).opening_mm = opening_mm_ * along.normalized();
}

void LiveSession::let_go() {
  if (!holding_) return;
  holding_ = false;
  depth_mm_ = 0;
  tips_.back().active = false;
  std::vector<Waypoint>& path = tool_record_.back().path;
  if (path.empty()) {  // let go before time went on: as if it had not been
    tips_.pop_back();
    tool_record_.pop_back();
    return;
  }
  // A tip is away from its last waypoint on.
  Waypoint last = path.back();
  last.time_s = double(steps_) * time_step_s_;
  if (steps_ < kMostRecorded) path.push_back(last);
}

void LiveSession::record_step() {
  if (steps_ < kMostRecorded) {
    camera_record_.push_back({static_cast<int>(steps_), pose_});
    if (holding_) {
      Waypoint here;
      here.time_s = double(steps_) * time_step_s_;
      here.position_mm = tips_.back().position_mm;
      here.opening_mm = opening_mm_;
      tool_record_.back().path.push_back(here);
    }
  }
  ++steps_;
}

PlayedFrame LiveSession::advance(bool step, int width, int height, DrawOptions options) {
  PlayedFrame played;
  const double time_s = double(steps_) * time_step_s_;  // at which the step begins
  if (holding_) {
    tips_.back().position_mm = tip_position_mm();
    if (tips_.back().is<Scissors>()) open_scissors();
    depth_mm_ = (tips_.back().position_mm - touched_mm_).dot(sight_) + tips_.back().radius_mm;
  }
  Stopwatch watch;
  if (step) {
    record_step();
    played.step = player_->step(tips_);
  }
  played.deform_ms = watch.lap();
  view_ = orbit_view(player_->bundle().cameras, pose_, width, height);
  options.keep_depth = true;
  options.solids = tools_.solids(tips_, view_, time_s);
  const std::vector<Solid> placed = placed_tools_.solids(placed_, view_, time_s);
  options.solids.insert(options.solids.end(), placed.begin(), placed.end());
  if (holding_) tool_record_.back().trocar_mm = tools_.trocar_mm(tips_.size() - 1);
  played.draw = player_->draw(view_, options, frame_);
  played.draw_ms = watch.lap();
  return played;
}

void LiveSession::reset() {
  let_go();
  player_->reset();
  tips_.clear();
  placed_.clear();
  camera_record_.clear();
  tool_record_.clear();
  steps_ = 0;
}

Script LiveSession::record(const std::string& name) const {
  Script script;
  script.name = name;
  script.time_step_s = time_step_s_;
  script.solver = player_->solver();
  script.frames = static_cast<int>(std::clamp<std::size_t>(steps_, 1, kMostRecorded));
  script.width = view_.camera.intrinsics.width;
  script.height = view_.camera.intrinsics.height;
  script.camera = camera_record_;
  if (script.camera.empty()) script.camera.push_back({0, pose_});
  for (const InstrumentPath& tool : tool_record_) {
    if (tool.path.empty()) continue;
    script.instruments.push_back(tool);
    // Still held: it must not be away before the last step.
    std::vector<Waypoint>& path = script.instruments.back().path;
    Waypoint last = path.back();
    last.time_s = double(script.frames) * time_step_s_;
    if (holding_ && &tool == &tool_record_.back()) path.push_back(last);
  }
  return script;
}

}  // namespace organbake
