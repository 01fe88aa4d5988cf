// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "organbake/instruments/instrument.h"
#include "organbake/player/player.h"
#include "organbake/player/script.h"

namespace organbake {

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

}  // namespace organbake
