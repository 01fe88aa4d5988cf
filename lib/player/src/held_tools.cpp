// SPDX-License-Identifier: Apache-2.0
// Draws the tools that a script or a session holds: for each a trocar, chosen so that the shaft is
// seen from its side and meets no organ if possible, and jaws or blades turned so that the viewer
// sees them open.
#include "organbake/player/held_tools.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/player/script_camera.h"
#include "tool_parts.h"
#include "trocar.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

std::vector<const Bundle*> bundles_of(const Player& player) {
  std::vector<const Bundle*> bundles;
  for (std::size_t o = 0; o < player.organ_count(); ++o) bundles.push_back(&player.bundle(o));
  return bundles;
}

double extent_mm(const Player& player) { return bounds(player.bundle().proxy).diagonal(); }

// Jaws open across the line of sight, where it can be seen.
Vector3d turned_to_eye(const ToolMoment& moment, const Vector3d& trocar_mm) {
  const Vector3d joint = moment.tool.end_mm();
  return (moment.view.camera.center_world_mm() - joint).cross(trocar_mm - joint).stableNormalized();
}

// Blades of scissors open to the side that they cut to, where that is known.
Vector3d aside_of(const Instrument& tool, const Vector3d& turned_to_eye) {
  const auto* scissors = std::get_if<Scissors>(&tool.kind);
  return scissors && !scissors->opening_mm.isZero(0) ? scissors->opening_mm : turned_to_eye;
}

// How far jaws stand open: they close in the first moments, so that a viewer sees it.
double jaws_open(double held_s) {
  constexpr double kClosing_s = 0.15;
  return std::clamp(1 - held_s / kClosing_s, 0.0, 1.0);
}

void add_parts(const Instrument& tool, const ToolHold& hold, std::size_t number,
               std::vector<Solid>& solids) {
  for (Solid part : tool_parts(tool, hold)) {
    part.instrument = static_cast<std::uint32_t>(number);
    solids.push_back(part);
  }
}

// Some of the moments of a script at which a tool is there: its waypoints, as far as they are few,
// and what lies between them.
std::vector<ToolMoment> moments_of(const Script& script, std::size_t tool,
                                   const InstrumentMotion& motion, const CameraSet& cameras) {
  constexpr int kMost = 12;
  const std::vector<Waypoint>& path = motion.paths()[tool].path;
  const double begin_s = path.front().time_s, end_s = path.back().time_s;
  std::vector<double> times;
  for (int i = 0; i < kMost; ++i) times.push_back(begin_s + i * (end_s - begin_s) / kMost);
  const std::size_t stride = 1 + path.size() / (2 * kMost);
  for (std::size_t w = 0; w + 1 < path.size(); w += stride) times.push_back(path[w].time_s);
  std::vector<ToolMoment> moments;
  for (const double time_s : times) {
    const Instrument there = motion.at(time_s)[tool];
    const int frame = static_cast<int>(std::lround(time_s / script.time_step_s));
    if (!there.active || frame >= script.frames) continue;
    constexpr int kWidth = 640, kHeight = 480;  // of a picture whose size tells nothing here
    moments.push_back({there, view_at(script, frame, cameras, kWidth, kHeight)});
  }
  return moments;
}

}  // namespace

struct ScriptTools::Held {
  std::optional<ToolHold> hold;     // none: the tool is never there
  std::optional<Vector3d> towards;  // where the script says that the shaft leads, by its length
  double since_s = 0;

  ToolHold at(const Instrument& tool, double time_s) const {
    ToolHold now = *hold;
    if (towards) now.trocar_mm = tool.end_mm() + *towards;
    now.aside = aside_of(tool, hold->aside);
    now.open = jaws_open(time_s - since_s);
    return now;
  }
};

ScriptTools::ScriptTools(const Script& script, const InstrumentMotion& motion,
                         const Player& player) {
  const TrocarChooser chooser(bundles_of(player));
  std::vector<TrocarChooser::Shaft> shafts;
  for (std::size_t i = 0; i < motion.paths().size(); ++i) {
    const InstrumentPath& path = motion.paths()[i];
    Held& held = held_.emplace_back();
    held.since_s = path.path.front().time_s;
    const auto moments = moments_of(script, i, motion, player.bundle().cameras);
    if (moments.empty()) continue;
    const ToolMoment& first = moments.front();
    ToolHold& hold = held.hold.emplace();
    if (path.shaft) {
      held.towards = 2 * extent_mm(player) * path.shaft->stableNormalized();
      hold.trocar_mm = first.tool.end_mm() + *held.towards;
    } else {
      hold.trocar_mm = path.trocar_mm ? *path.trocar_mm : chooser.choose(moments, shafts);
    }
    hold.aside = turned_to_eye(first, hold.trocar_mm);
    shafts.push_back({first.tool.end_mm(), hold.trocar_mm});
  }
}
ScriptTools::~ScriptTools() = default;
ScriptTools::ScriptTools(ScriptTools&&) noexcept = default;

std::vector<Solid> ScriptTools::solids(const std::vector<Instrument>& instruments,
                                       double time_s) const {
  std::vector<Solid> solids;
  for (std::size_t i = 0; i < instruments.size(); ++i)
    if (instruments[i].active && held_[i].hold)
      add_parts(instruments[i], held_[i].at(instruments[i], time_s), i, solids);
  return solids;
}

std::optional<Vector3d> ScriptTools::trocar_mm(std::size_t instrument) const {
  const Held& held = held_[instrument];
  if (!held.hold || held.towards) return std::nullopt;
  return held.hold->trocar_mm;
}

struct HeldTools::Held {
  ToolHold hold;
  double since_s = 0;
};

HeldTools::HeldTools(const Player& player)
    : chooser_(std::make_unique<TrocarChooser>(bundles_of(player))) {}
HeldTools::~HeldTools() = default;
HeldTools::HeldTools(HeldTools&&) noexcept = default;
HeldTools& HeldTools::operator=(HeldTools&&) noexcept = default;

void HeldTools::put_down() { held_.clear(); }

std::vector<Solid> HeldTools::solids(const std::vector<Instrument>& instruments, const View& view,
                                     double time_s) {
  held_.resize(instruments.size());
  std::vector<TrocarChooser::Shaft> shafts;
  for (std::size_t i = 0; i < instruments.size(); ++i) {
    if (!instruments[i].active) held_[i].reset();
    if (held_[i]) shafts.push_back({instruments[i].end_mm(), held_[i]->hold.trocar_mm});
  }
  std::vector<Solid> solids;
  for (std::size_t i = 0; i < instruments.size(); ++i) {
    const Instrument& tool = instruments[i];
    if (!tool.active) continue;
    if (!held_[i]) {
      const ToolMoment now = {tool, view};
      const Vector3d trocar_mm = chooser_->choose({now}, shafts);
      held_[i] = Held{{trocar_mm, turned_to_eye(now, trocar_mm)}, time_s};
      shafts.push_back({tool.end_mm(), trocar_mm});
    }
    ToolHold hold = held_[i]->hold;
    hold.open = jaws_open(time_s - held_[i]->since_s);
    hold.aside = aside_of(tool, hold.aside);
    add_parts(tool, hold, i, solids);
  }
  return solids;
}

std::optional<Vector3d> HeldTools::trocar_mm(std::size_t instrument) const {
  if (instrument >= held_.size() || !held_[instrument]) return std::nullopt;
  return held_[instrument]->hold.trocar_mm;
}

}  // namespace organbake
