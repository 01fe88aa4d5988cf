// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "organbake/instruments/instrument.h"
#include "organbake/player/held_tools.h"
#include "organbake/player/player.h"
#include "organbake/player/script.h"
#include "organbake/warp/view.h"

namespace organbake {

// Where the tool is that a pointer put onto the skin and has dragged since, as
// LiveSession::touch() tells. Pixels are those of the picture that was touched.
class PointerTool {
 public:
  // skin_depth_mm: of the skin that the picture shows there.
  PointerTool(const View& touched, const Eigen::Vector2d& at_px, double skin_depth_mm);

  // The tool as it touches the skin. radius_mm: of a ball or a grasper; other kinds have their own.
  Instrument tool(const InstrumentKind& kind, double radius_mm) const;

  void drag(const Eigen::Vector2d& to_px) { pointer_px_ = to_px; }
  void push(double mm) { pushed_mm_ += mm; }  // along the line of sight, away from the eye when > 0

  void move(Instrument& tool);                   // to where it is now; scissors open
  double depth_mm() const { return depth_mm_; }  // below the skin touched, once it was moved
  double opening_mm() const { return opening_mm_; }
  // Along which scissors open, of any length: across the view until they are dragged.
  const Eigen::Vector3d& opens_along() const { return opens_along_; }

 private:
  Eigen::Vector3d dragged_mm() const;
  Eigen::Vector3d position_mm(const Instrument& tool) const;
  void open(Scissors& scissors);

  View touched_;
  Eigen::Vector2d touched_px_, pointer_px_;
  Eigen::Vector3d touched_mm_;  // the skin there, world
  Eigen::Vector3d sight_;       // unit, from the eye to it
  Eigen::Vector3d opens_along_;
  double pushed_mm_ = 0, depth_mm_ = 0, opening_mm_ = 0;
};

// What was done in front of an organ, step by step from rest: where the eye was, and every touch,
// each a tool of its own. It is a script that plays back bit for bit, and the list of touches that
// can be undone.
class SessionRecord {
 public:
  static constexpr std::size_t kMostSteps = 100'000;  // later ones are not kept

  explicit SessionRecord(double time_step_s) : time_step_s_(time_step_s) {}

  std::size_t steps() const { return poses_.size(); }
  bool full() const { return steps() == kMostSteps; }
  double time_s(std::size_t step) const { return double(step) * time_step_s_; }

  // A tool that comes with the next step; of one that went before it came nothing stays.
  void begin_touch(InstrumentPath tool);
  InstrumentPath& last_touch() { return touches_.back().tool; }
  void end_touch();
  // One step, with the place of the last touch's tool while it is held.
  void add_step(const OrbitPose& pose, const std::optional<Waypoint>& held);
  // Forgets a step and all that follow; what is held there is let go.
  void cut_short(std::size_t steps);

  std::size_t touch_count() const { return touches_.size(); }
  bool has_blades() const;
  const OrbitPose& pose_at(std::size_t step) const { return poses_[step]; }
  // The tools of a step: of every touch that has begun by then, active or not.
  std::vector<Instrument> tools_at(std::size_t step) const;
  // Where the touch before a step began, or the one behind it does; the end behind the last one.
  std::optional<std::size_t> begin_before(std::size_t step) const;
  std::size_t begin_behind(std::size_t step) const;

  // Camera and instruments of the first `steps`; a tool that is held still is so up to their end.
  void write(Script& script, std::size_t steps) const;

 private:
  struct Touch {
    std::size_t first_step;
    InstrumentPath tool;
    bool held;
  };
  // Cut short there, with a last waypoint from which on the tool is away.
  InstrumentPath until(const Touch& touch, std::size_t steps) const;

  double time_step_s_;
  std::vector<OrbitPose> poses_;
  std::vector<Touch> touches_;
};

// Moments of a session to go back to at once, by their steps from rest: one for each second, and
// one for each touch's beginning. Beyond a measure of memory those are forgotten that lie closest
// together for their age, the beginnings of touches last.
class SessionStates {
 public:
  // Programs of 32 bits, as pages are, have less to spare.
  static constexpr std::size_t kMostBytes = (sizeof(void*) > 4 ? 150 : 40) * std::size_t{1'000'000};

  explicit SessionStates(std::size_t most_bytes = kMostBytes) : most_bytes_(most_bytes) {}

  bool has(std::size_t step) const;
  void keep(Player::State state, bool begins_touch);
  void begins_touch(std::size_t step);  // of one that there is
  // The last one that is not after a step; an empty one where there is none.
  Player::State before(std::size_t step) const;
  void forget_after(std::size_t step);
  void clear();
  std::size_t count() const { return kept_.size(); }
  std::size_t bytes() const { return bytes_; }

 private:
  struct Kept {
    Player::State state;
    bool begins_touch;
    std::size_t bytes;  // beside the one before it
  };
  void measure(std::size_t kept);
  void forget(std::size_t kept);
  std::size_t least_missed() const;

  std::size_t most_bytes_, bytes_ = 0;
  std::vector<Kept> kept_;  // by steps, increasing
};

// A person in front of the organ, without the window: an eye on its orbit, a tool under the
// pointer, time in steps, and a record that plays back bit for bit. The pointer is told in pixels
// of the last picture, (0, 0) its upper left corner.
class LiveSession {
 public:
  // The player must have been made with the same time step, and starts from rest.
  LiveSession(Player& player, double time_step_s);

  void turn(const Eigen::Vector2d& by_px);   // the organ follows the pointer round its centre
  void shift(const Eigen::Vector2d& by_px);  // the organ follows the pointer across the picture
  void zoom(double steps);                   // > 0 comes nearer
  void face_front();  // the view the session began with, in which all organs are seen
  // From the lens to the skin straight ahead in the last picture; nothing where there is none.
  std::optional<double> scope_distance_mm() const;
  // Brings the lens there, along its sight; no nearer than kNearestScope_mm.
  void set_scope_distance_mm(double distance_mm);
  static constexpr double kNearestScope_mm = 1;
  // Across the smaller side of the picture: of virtual camera 0, unless another lens is set.
  double view_angle_deg() const;
  void set_view_angle_deg(double angle_deg);

  // Puts a tool of a kind, with the numbers that it has, onto the tissue at the pointer; false when
  // there is none. A ball presses
  // along the line of sight, as deep as the pointer is then dragged away; a grasper carries
  // the tissue across the view; a blade is drawn across it, 8 mm below the place touched; a
  // needle goes in along the line of sight, like a ball. Scissors are put in along it, and
  // open as the pointer is dragged away, to 20 mm; dragged back, they close and cut.
  bool touch(const Eigen::Vector2d& at_px, const InstrumentKind& kind);
  void drag(const Eigen::Vector2d& to_px);
  void push(double mm);  // a held tool along the line of sight, away from the eye when > 0
  void let_go();
  bool holds() const { return pointer_.has_value(); }
  double tool_radius_mm() const { return tool_radius_mm_; }
  void set_tool_radius_mm(double radius_mm) { tool_radius_mm_ = radius_mm; }  // of the next touch

  // One time step, and what it looks like: frame(), with its depth, unless the player shows its
  // pictures elsewhere. Without `step` time stands
  // still and only the picture is made. While the organ is on its way to another step of the record
  // (seek()), it gets there by as many steps at once as take about 10 ms.
  PlayedFrame advance(bool step, int width, int height, const DrawOptions& options);
  PlayedFrame pass_time(bool step);  // the same without the picture
  const Frame& frame() const { return frame_; }
  // The same options as the last picture was drawn with, its tools among them, for another view.
  DrawOptions drawn(DrawOptions options) const;
  // Tools in the next pictures that push nothing, beside those that hands hold; until the reset.
  void place_tools(std::vector<Instrument> tools) { placed_ = std::move(tools); }

  void reset();  // the organ at rest, a new record
  // The same organ under another solver: what was done so far is done to it again. Springs cannot
  // follow blades: then it is reset. Throws as Player::set_solver().
  void set_solver(TissueSolver solver);

  // All steps since the start or the last reset, as a script that play() repeats to the last bit.
  // At most SessionRecord::kMostSteps; later ones are not kept.
  Script record(const std::string& name) const;
  std::size_t recorded_steps() const { return record_.steps(); }
  const SessionStates& states() const { return states_; }
  bool records() const { return !stopped_at_; }
  void stop_recording();  // what follows is no part of record(), until the reset
  std::size_t record_end() const {
    return std::min(record_.steps(), stopped_at_.value_or(record_.steps()));
  }

  // Back and forth in what was done. Before the end of the record time stands still, until it is
  // played on or tissue is touched: what was recorded from there on is then forgotten. Steps beyond
  // the longest record cannot be undone. What moves the organs is kept once a second and where
  // touches begin (SessionStates), so that undo, redo and replay are there at once; to other steps
  // seek() goes on from what was kept before them.
  std::size_t position() const { return steps_; }  // steps from rest
  void seek(std::size_t step);
  bool seeking() const { return target_.has_value(); }
  bool can_undo() const { return !lost_track() && record_.begin_before(bound_for()).has_value(); }
  bool can_redo() const { return !lost_track() && bound_for() < record_.steps(); }
  void undo();  // the last touch, and what followed it
  void redo();
  void replay();  // from rest to the record's end, as it was seen
  bool replaying() const { return replaying_; }
  void stop_replay() { replaying_ = false; }

  const View& view() const { return view_; }
  // Of the held tool below the place it touched.
  double depth_mm() const { return pointer_ ? pointer_->depth_mm() : 0; }

 private:
  // What the last picture shows at a pixel, and how far away; nothing before there is one.
  struct Seen {
    Cover cover;
    float depth_mm;
  };
  std::optional<Seen> seen_at(const Eigen::Vector2i& pixel) const;
  void take_tool(const InstrumentKind& kind);
  void move_tool();
  void record_step();
  StepReport step_live();
  StepReport step_recorded();
  StepReport approach_target();
  void go_on_from_here();
  void begin_anew();
  void keep_state(bool begins_touch);
  void keep_each_second();
  void go_back_to(const Player::State& state);
  std::size_t bound_for() const { return target_.value_or(steps_); }
  bool lost_track() const { return steps_ > record_.steps(); }
  void draw(int width, int height, const DrawOptions& options, double time_s, PlayedFrame& played);

  Player* player_;
  double time_step_s_;
  double tool_radius_mm_;
  OrbitPose front_, pose_;
  std::optional<double> view_angle_deg_;
  View view_;  // of the last picture
  Frame frame_;
  std::vector<Solid> solids_;          // in it
  mutable std::optional<Seen> ahead_;  // in its middle, once that was asked for
  HeldTools tools_, placed_tools_;
  std::vector<Instrument> tips_;  // one for each touch so far; the last may be active
  std::vector<Instrument> placed_;
  std::optional<PointerTool> pointer_;  // while a tool is held
  SessionRecord record_;
  SessionStates states_;
  std::size_t steps_ = 0;
  std::optional<std::size_t> target_, stopped_at_;
  bool replaying_ = false;
};

}  // namespace organbake
