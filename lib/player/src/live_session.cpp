// SPDX-License-Identifier: Apache-2.0
// Every step is recorded as waypoints of a script, from what the pointer asked for, not from where
// tools were held: played again, the same solver holds them off in the same way.
#include "organbake/player/live_session.h"

#include <cmath>
#include <numbers>

#include "organbake/core/stopwatch.h"
#include "organbake/player/orbit.h"
#include "trocar.h"

namespace organbake {
namespace {

// The depth (mm) at which a pixel's ray first meets the skin as it lies now, whatever tools stand
// before it and without its relief; nothing where it meets none. By its crossings with every face:
// it is asked once for a touch, so that no tree is worth its upkeep.
std::optional<double> skin_depth_mm(const Player& player, const View& view,
                                    const Eigen::Vector2i& pixel) {
  const PosedCamera& camera = view.camera;
  const Eigen::Vector3d eye = camera.center_world_mm();
  const Eigen::Vector2d middle = pixel.cast<double>() + Eigen::Vector2d(0.5, 0.5);
  const Eigen::Vector3d ray =
      camera.camera_from_world.rotation.transpose() * unproject(camera.intrinsics, middle);
  std::optional<double> nearest;
  for (std::size_t o = 0; o < player.organ_count(); ++o) {
    const TriangleMesh skin = player.bundle_now(o).shell().posed(player.proxy_positions(o));
    for (const auto& [a, b, c] : skin.faces) {
      const std::optional<double> depth_mm =
          line_crossing(eye, ray, skin.vertices[a], skin.vertices[b], skin.vertices[c]);
      if (depth_mm && *depth_mm > view.near_mm && (!nearest || depth_mm < nearest))
        nearest = depth_mm;
    }
  }
  return nearest;
}

constexpr double kTurnPerPicture_rad = std::numbers::pi;  // a drag across the smaller side
constexpr double kZoomPerStep = 0.9;
constexpr double kNearest = 0.35, kFarthest = 4;  // of the virtual cameras' distance
constexpr double kHighest_rad = 1.5;
constexpr double kNarrowest_deg = 5, kWidest_deg = 120;
constexpr double kSeek_ms = 10;  // of a picture's time

double smaller_side(const View& view) {
  return std::min(view.camera.intrinsics.width, view.camera.intrinsics.height);
}

}  // namespace

LiveSession::LiveSession(Player& player, double time_step_s)
    : player_(&player),
      time_step_s_(time_step_s),
      tool_radius_mm_(player.bundle().mechanics.instrument_radius_mm),
      front_(framing_pose(player)),
      pose_(front_),
      tools_(player),
      placed_tools_(player),
      record_(time_step_s) {
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
  // A scope may be nearer already, and several organs farther away.
  const double nearest = std::min(kNearest, pose_.distance);
  const double farthest = std::max(kFarthest, 2 * front_.distance);
  pose_.distance = std::clamp(pose_.distance * std::pow(kZoomPerStep, steps), nearest, farthest);
}

void LiveSession::face_front() { pose_ = front_; }

// Of a picture that was not kept, the processor draws the pixel with those round it, across which
// it fills holes.
std::optional<LiveSession::Seen> LiveSession::seen_at(const Eigen::Vector2i& pixel) const {
  const std::size_t index = std::size_t(pixel.y()) * view_.camera.intrinsics.width + pixel.x();
  if (index < frame_.depth_mm.size()) return Seen{frame_.cover[index], frame_.depth_mm[index]};
  if (frame_.serial == 0) return std::nullopt;
  constexpr int kAround = 3, kSide = 2 * kAround + 1;
  View close = view_;
  Intrinsics& lens = close.camera.intrinsics;
  lens.width = lens.height = kSide;
  lens.cx -= pixel.x() - kAround, lens.cy -= pixel.y() - kAround;
  DrawOptions options;
  options.light = DrawnLight::baked;  // of all, the quickest: nobody sees its colours
  options.keep_depth = true;
  options.solids = solids_;
  Frame frame;
  player_->draw_by_processor(close, options, frame);
  constexpr std::size_t kMiddle = kAround * kSide + kAround;
  return Seen{frame.cover[kMiddle], frame.depth_mm[kMiddle]};
}

std::optional<double> LiveSession::scope_distance_mm() const {
  const Intrinsics& picture = view_.camera.intrinsics;
  const Eigen::Vector2i middle(picture.width / 2, picture.height / 2);
  if (!ahead_) ahead_ = seen_at(middle);
  if (ahead_ && ahead_->cover == Cover::solid) return skin_depth_mm(*player_, view_, middle);
  if (!ahead_ || !std::isfinite(ahead_->depth_mm)) return std::nullopt;
  return ahead_->depth_mm;
}

void LiveSession::set_scope_distance_mm(double distance_mm) {
  const std::optional<double> now_mm = scope_distance_mm();
  if (!now_mm) return;
  const CameraSet& cameras = player_->bundle().cameras;
  const double unit_mm =
      (cameras.cameras.front().center_world_mm() - cameras.manifold.center_world_mm).norm();
  const double least = 1e-3;  // a pose lies before what it looks at
  pose_.distance = std::max(
      least, pose_.distance + (std::max(kNearestScope_mm, distance_mm) - *now_mm) / unit_mm);
}

double LiveSession::view_angle_deg() const {
  constexpr double kDegrees = 180 / std::numbers::pi;
  const double focal = view_.camera.intrinsics.fx;
  return view_angle_deg_.value_or(2 * kDegrees * std::atan(0.5 * smaller_side(view_) / focal));
}

void LiveSession::set_view_angle_deg(double angle_deg) {
  view_angle_deg_ = std::clamp(angle_deg, kNarrowest_deg, kWidest_deg);
}

bool LiveSession::touch(const Eigen::Vector2d& at_px, const InstrumentKind& kind) {
  const Intrinsics& picture = view_.camera.intrinsics;
  const Eigen::Vector2i pixel = at_px.array().floor().cast<int>();
  if (seeking() || pixel.x() < 0 || pixel.y() < 0 || pixel.x() >= picture.width ||
      pixel.y() >= picture.height) {
    return false;
  }
  const std::optional<Seen> seen = seen_at(pixel);
  if (!seen || !std::isfinite(seen->depth_mm)) return false;
  go_on_from_here();
  keep_state(true);
  pointer_.emplace(view_, at_px, seen->depth_mm);
  take_tool(kind);
  return true;
}

void LiveSession::take_tool(const InstrumentKind& kind) {
  const Instrument tool = pointer_->tool(kind, tool_radius_mm_);
  tips_.push_back(tool);
  InstrumentPath record;
  record.name = mode_of(kind);
  record.instrument = tool;
  record_.begin_touch(std::move(record));
}

void LiveSession::drag(const Eigen::Vector2d& to_px) {
  if (pointer_) pointer_->drag(to_px);
}

void LiveSession::push(double mm) {
  if (pointer_) pointer_->push(mm);
}

void LiveSession::move_tool() {
  pointer_->move(tips_.back());
  if (Scissors* scissors = std::get_if<Scissors>(&record_.last_touch().instrument.kind))
    scissors->opening_mm = pointer_->opens_along();
}

void LiveSession::let_go() {
  if (!holds()) return;
  pointer_.reset();
  tips_.back().active = false;
  record_.end_touch();
  tips_.resize(record_.touch_count());
}

void LiveSession::record_step() {
  std::optional<Waypoint> held;
  if (holds()) {
    held.emplace();
    held->time_s = record_.time_s(steps_);
    held->position_mm = tips_.back().position_mm;
    held->opening_mm = pointer_->opening_mm();
  }
  record_.add_step(pose_, held);
  ++steps_;
}

void LiveSession::keep_state(bool begins_touch) {
  if (lost_track()) return;
  if (!states_.has(steps_)) {
    states_.keep(player_->save_state(states_.before(steps_)), begins_touch);
  } else if (begins_touch) {
    states_.begins_touch(steps_);
  }
}

void LiveSession::keep_each_second() {
  const auto second = static_cast<std::size_t>(std::max(1.0, std::round(1 / time_step_s_)));
  if (steps_ % second == 0) keep_state(false);
}

StepReport LiveSession::step_live() {
  keep_each_second();
  record_step();
  return player_->step(tips_);
}

StepReport LiveSession::step_recorded() {
  keep_each_second();
  tips_ = record_.tools_at(steps_);
  ++steps_;
  return player_->step(tips_);
}

StepReport LiveSession::approach_target() {
  StepReport report;
  Stopwatch watch;
  for (double spent_ms = 0; steps_ < *target_ && spent_ms < kSeek_ms; spent_ms += watch.lap())
    report = step_recorded();
  if (steps_ == *target_) target_.reset();
  return report;
}

PlayedFrame LiveSession::advance(bool step, int width, int height, const DrawOptions& options) {
  const double time_s = record_.time_s(steps_);  // at which the step begins
  PlayedFrame played = pass_time(step);
  Stopwatch watch;
  draw(width, height, options, time_s, played);
  played.draw_ms = watch.lap();
  return played;
}

PlayedFrame LiveSession::pass_time(bool step) {
  PlayedFrame played;
  if (holds()) move_tool();
  Stopwatch watch;
  if (target_) {
    played.step = approach_target();
  } else if (step && replaying_) {
    pose_ = record_.pose_at(steps_);
    played.step = step_recorded();
    replaying_ = steps_ < record_end();
  } else if (step && steps_ >= record_.steps()) {
    played.step = step_live();
  }
  played.deform_ms = watch.lap();
  // Tools are shown where they were held: at each other, or at anchored skin.
  for (std::size_t i = 0; i < played.step.tip_position_mm.size(); ++i)
    tips_[i].position_mm = played.step.tip_position_mm[i];
  return played;
}

void LiveSession::draw(int width, int height, const DrawOptions& options, double time_s,
                       PlayedFrame& played) {
  view_ = orbit_view(player_->bundle().cameras, pose_, width, height);
  if (view_angle_deg_) {
    const double half_rad = *view_angle_deg_ * std::numbers::pi / 360;
    Intrinsics& lens = view_.camera.intrinsics;
    lens.fx = lens.fy = 0.5 * std::min(width, height) / std::tan(half_rad);
  }
  solids_ = tools_.solids(tips_, view_, time_s);
  const std::vector<Solid> placed = placed_tools_.solids(placed_, view_, time_s);
  solids_.insert(solids_.end(), placed.begin(), placed.end());
  if (holds()) record_.last_touch().trocar_mm = tools_.trocar_mm(tips_.size() - 1);
  played.draw = player_->draw(view_, drawn(options), frame_);
  ahead_.reset();
}

DrawOptions LiveSession::drawn(DrawOptions options) const {
  options.keep_depth = !player_->shows_pictures();
  options.solids = solids_;
  return options;
}

void LiveSession::begin_anew() {
  player_->reset();
  tips_.clear();
  tools_ = HeldTools(*player_);
  steps_ = 0;
}

void LiveSession::reset() {
  let_go();
  begin_anew();
  placed_.clear();
  record_ = SessionRecord(time_step_s_);
  states_.clear();
  if (player_->cut_times()) player_->set_cut_times(Player::CutTimes{});
  target_.reset();
  stopped_at_.reset();
  replaying_ = false;
}

void LiveSession::set_solver(TissueSolver solver) {
  if (solver == player_->solver()) return;
  const std::size_t position = bound_for();
  let_go();
  player_->set_solver(solver);
  if (position > record_.steps() || (solver == TissueSolver::springs && record_.has_blades()))
    return reset();
  states_.clear();
  begin_anew();
  seek(position);
}

void LiveSession::stop_recording() {
  let_go();
  stopped_at_ = record_.steps();
}

void LiveSession::seek(std::size_t step) {
  let_go();
  if (lost_track()) return;
  replaying_ = false;
  const std::size_t target = std::min(step, record_.steps());
  const Player::State kept = states_.before(target);
  if (target < steps_ || kept.steps() > steps_) kept ? go_back_to(kept) : begin_anew();
  target_.reset();
  if (target > steps_) target_ = target;
}

void LiveSession::go_back_to(const Player::State& state) {
  player_->restore_state(state);
  steps_ = state.steps();
  tips_.clear();
  if (steps_ > 0) tips_ = record_.tools_at(steps_ - 1);
  tools_.put_down();
}

void LiveSession::undo() {
  let_go();
  if (!can_undo()) return;
  keep_state(true);  // for redo()
  seek(*record_.begin_before(bound_for()));
}

void LiveSession::redo() {
  if (can_redo()) seek(record_.begin_behind(bound_for()));
}

void LiveSession::replay() {
  seek(0);
  replaying_ = steps_ < record_end();
}

// What lay ahead in the record will not happen any more.
void LiveSession::go_on_from_here() {
  replaying_ = false;
  if (steps_ >= record_.steps()) return;
  record_.cut_short(steps_);
  states_.forget_after(steps_);
  if (auto times = player_->cut_times()) {
    std::erase_if(times->steps, [&](std::uint32_t s) { return s >= steps_; });
    times->known_steps = std::min(times->known_steps, steps_);
    player_->set_cut_times(std::move(times));
  }
  if (stopped_at_) stopped_at_ = std::min(*stopped_at_, steps_);
  tips_.resize(record_.touch_count());
  for (Instrument& tip : tips_) tip.active = false;
}

Script LiveSession::record(const std::string& name) const {
  Script script;
  script.name = name;
  script.time_step_s = time_step_s_;
  script.solver = player_->solver();
  script.frames = static_cast<int>(std::max<std::size_t>(record_end(), 1));
  script.width = view_.camera.intrinsics.width;
  script.height = view_.camera.intrinsics.height;
  if (view_angle_deg_) script.lens = view_.camera.intrinsics;
  record_.write(script, record_end());
  const auto cuts = [](const InstrumentPath& tool) {
    return has_blade(tool.instrument.kind) || tool.instrument.is<Needle>();
  };
  if (const auto& times = player_->cut_times();
      times && std::any_of(script.instruments.begin(), script.instruments.end(), cuts)) {
    script.cuts_part_in = times->steps;
    std::erase_if(*script.cuts_part_in, [&](std::uint32_t s) { return s >= record_end(); });
  }
  if (script.camera.empty()) script.camera.push_back({0, pose_});
  return script;
}

}  // namespace organbake
