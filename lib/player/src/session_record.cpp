// SPDX-License-Identifier: Apache-2.0
// The record of a live session, from which it can be saved as a script, undone to the touch before,
// or cut short. A touch is a tool with waypoints for all of its steps.
#include "organbake/player/session_record.h"

#include <algorithm>
#include <utility>

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

}  // namespace organbake
