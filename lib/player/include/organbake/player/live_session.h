// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "organbake/player/held_tools.h"
#include "organbake/player/play.h"
#include "organbake/player/player.h"
#include "organbake/player/pointer_tool.h"
#include "organbake/player/script.h"
#include "organbake/player/session_record.h"

namespace organbake {

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

  // Puts a tool of a kind onto the tissue at the pointer; false when there is none. A ball presses
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
  // How wide a strip of tissue the next one that cuts takes away.
  double cut_width_mm() const { return cut_width_mm_; }
  void set_cut_width_mm(double width_mm) { cut_width_mm_ = width_mm; }

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
  double tool_radius_mm_, cut_width_mm_ = 0;
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
