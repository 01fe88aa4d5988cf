// SPDX-License-Identifier: Apache-2.0
// The record of a live session, from which it can be saved as a script, undone to the touch before,
// or cut short; and the tool that a pointer moves. A touch is a tool with waypoints for all of its
// steps.
#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "organbake/player/live_session.h"

namespace organbake {
void SessionRecord::begin_touch(InstrumentPath tool) {
  touches_.push_back({steps(), std::move(tool), true});
}

void SessionRecord::end_touch() {
  Touch& touch = touches_.back();
  touch.held = false;
  std::vector<Waypoint>& path = touch.tool.path;
  if (path.empty()) {  // let go before time went on: as if it had not been
    touches_.pop_back();
    return;
  }
  if (full()) return;
  // A tip is away from its last waypoint on.
  Waypoint last = path.back();
  last.time_s = time_s(steps());
  path.push_back(last);
}

void SessionRecord::add_step(const OrbitPose& pose, const std::optional<Waypoint>& held) {
  if (full()) return;
  if (held) last_touch().path.push_back(*held);
  poses_.push_back(pose);
}

InstrumentPath SessionRecord::until(const Touch& touch, std::size_t steps) const {
  InstrumentPath tool = touch.tool;
  const double end_s = time_s(steps);
  const bool there_at_end = touch.held || tool.path.back().time_s >= end_s;
  std::erase_if(tool.path, [end_s](const Waypoint& w) { return w.time_s >= end_s; });
  if (there_at_end && !tool.path.empty()) {
    Waypoint last = tool.path.back();
    last.time_s = end_s;
    tool.path.push_back(last);
  }
  return tool;
}

void SessionRecord::cut_short(std::size_t steps) {
  std::erase_if(touches_, [steps](const Touch& t) { return t.first_step >= steps; });
  for (Touch& touch : touches_) {
    touch.tool = until(touch, steps);
    touch.held = false;
  }
  poses_.resize(std::min(poses_.size(), steps));
}

bool SessionRecord::has_blades() const {
  return std::any_of(touches_.begin(), touches_.end(),
                     [](const Touch& t) { return has_blade(t.tool.instrument.kind); });
}

std::vector<Instrument> SessionRecord::tools_at(std::size_t step) const {
  std::vector<Instrument> tools;
  for (const Touch& touch : touches_)
    if (touch.first_step <= step) tools.push_back(touch.tool.at(time_s(step)));
  return tools;
}

std::optional<std::size_t> SessionRecord::begin_before(std::size_t step) const {
  std::optional<std::size_t> begin;
  for (const Touch& touch : touches_)
    if (touch.first_step < step) begin = touch.first_step;
  return begin;
}

std::size_t SessionRecord::begin_behind(std::size_t step) const {
  for (const Touch& touch : touches_)
    if (touch.first_step > step) return touch.first_step;
  return steps();
}

void SessionRecord::write(Script& script, std::size_t steps) const {
  for (std::size_t step = 0; step < std::min(steps, poses_.size()); ++step)
    script.camera.push_back({static_cast<int>(step), poses_[step]});
  for (const Touch& touch : touches_) {
    if (touch.tool.path.empty() || touch.first_step >= steps) continue;
    script.instruments.push_back(until(touch, steps));
  }
}

bool SessionStates::has(std::size_t step) const {
  const Player::State state = before(step);
  return state && state.steps() == step;
}

Player::State SessionStates::before(std::size_t step) const {
  const auto next = std::upper_bound(
      kept_.begin(), kept_.end(), step,
      [](std::size_t wanted, const Kept& kept) { return wanted < kept.state.steps(); });
  return next == kept_.begin() ? Player::State() : std::prev(next)->state;
}

void SessionStates::begins_touch(std::size_t step) {
  for (Kept& kept : kept_)
    if (kept.state.steps() == step) kept.begins_touch = true;
}

void SessionStates::keep(Player::State state, bool begins_touch) {
  const auto next = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& kept) {
    return kept.state.steps() >= state.steps();
  });
  const auto number = static_cast<std::size_t>(next - kept_.begin());
  kept_.insert(next, {std::move(state), begins_touch, 0});
  measure(number);
  measure(number + 1);
  while (bytes_ > most_bytes_ && kept_.size() > 2) forget(least_missed());
}

void SessionStates::measure(std::size_t number) {
  if (number >= kept_.size()) return;
  Kept& kept = kept_[number];
  const std::size_t before = std::exchange(
      kept.bytes, kept.state.bytes_beside(number > 0 ? kept_[number - 1].state : Player::State()));
  bytes_ += kept.bytes - before;
}

void SessionStates::forget(std::size_t number) {
  bytes_ -= kept_[number].bytes;
  kept_.erase(kept_.begin() + static_cast<std::ptrdiff_t>(number));
  measure(number);
}

// Neither the first nor the last one.
std::size_t SessionStates::least_missed() const {
  constexpr double kOfTouch = 1e6, kYoung = 60;  // steps
  const auto at = [this](std::size_t i) { return double(kept_[i].state.steps()); };
  std::size_t least = 1;
  double least_gap = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i + 1 < kept_.size(); ++i) {
    const double age = at(kept_.size() - 1) - at(i) + kYoung;
    const double gap = (kept_[i].begins_touch ? kOfTouch : 1) * (at(i + 1) - at(i - 1)) / age;
    if (gap < least_gap) least_gap = gap, least = i;
  }
  return least;
}

void SessionStates::forget_after(std::size_t step) {
  while (!kept_.empty() && kept_.back().state.steps() > step) forget(kept_.size() - 1);
}

void SessionStates::clear() {
  kept_.clear();
  bytes_ = 0;
}

// A tool that a mouse or a finger moves: from where it was put onto the skin and how far it was
// dragged in the picture follow its place, its depth and, of scissors, the opening.
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
