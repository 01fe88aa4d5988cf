// SPDX-License-Identifier: Apache-2.0
// Draws the tools that a script or a session holds: for each a trocar, chosen so that the shaft is
// seen from its side and meets no organ if possible, and jaws or blades turned so that the viewer
// sees them open. They are built of balls, rods and plates.
#include "organbake/player/held_tools.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/instruments/instrument.h"
#include "trocar.h"

namespace organbake {
namespace {

// How a tool is held at one moment.
struct ToolHold {
  Eigen::Vector3d trocar_mm;  // where its shaft ends, world
  // Which of the ways it could be turned about its shaft: jaws open along it, a blade's back lies
  // towards it. Of any length, not along the shaft; the same as long as the tool is held.
  Eigen::Vector3d aside;
  double open = 0;  // of jaws: 0 as they hold tissue, 1 before they close
};

using Eigen::Vector3d;
using Eigen::Vector3f;

const Vector3f kSteel(0.42f, 0.43f, 0.45f), kDullSteel(0.2f, 0.205f, 0.215f),
    kInsulation(0.03f, 0.03f, 0.033f);

constexpr double kShaft_mm = 2.5;       // radius of the usual instrument of 5 mm
constexpr double kLeastShaft_mm = 0.6;  // of those for small organs

// Unit, across `along`, as near to `wanted` as may be.
Vector3d across(const Vector3d& along, const Vector3d& wanted) {
  const Vector3d rest = wanted - along * along.dot(wanted);
  constexpr double kAlike = 1e-6;
  return rest.norm() > kAlike * wanted.norm() ? rest.normalized() : along.unitOrthogonal();
}

// What a viewer sees of a tool: a probe's ball, a grasper's jaws, a scalpel, a hook, scissors, a
// needle in its holder, and the shaft that leads to its trocar. Always as many parts of a kind, in
// one order. They are looks alone: what touches is the instrument's tip.
class ToolDrawing {
 public:
  ToolDrawing(const Instrument& tool, const ToolHold& hold)
      : tool_(tool),
        tip_(tool.position_mm),
        end_(tool.end_mm()),
        radius_(tool.radius_mm),
        trocar_(hold.trocar_mm),
        along_((hold.trocar_mm - end_).stableNormalized()),
        aside_(across(along_, hold.aside)),
        wanted_(hold.aside),
        open_(hold.open) {}

  std::vector<Solid> draw() {
    std::visit([&](const auto& kind) { add(kind); }, tool_.kind);
    return std::move(parts_);
  }

 private:
  void rod(const Vector3d& from, const Vector3d& to, double radius, const Vector3f& color) {
    parts_.push_back({from, to, radius, {}, color});
  }
  void plate(const std::array<Vector3d, 3>& at, double radius) {
    parts_.push_back({at[0], at[1], radius, at[2], kSteel});
  }
  void shaft(const Vector3d& from, double radius, const Vector3f& color) {
    rod(from, trocar_, std::clamp(radius, kLeastShaft_mm, kShaft_mm), color);
  }
  // Two tapering jaws from a hinge to tips that stand `gap` off the middle each.
  void jaws(const Vector3d& hinge, const Vector3d& tips, double gap, double width, double thick) {
    const Vector3d forward = (tips - hinge).normalized(), apart = across(forward, aside_);
    const Vector3d wide = width * forward.cross(apart);
    for (const double side : {-gap, gap})
      plate({hinge, tips + side * apart - wide, tips + side * apart + wide}, thick);
    rod(hinge, hinge, 1.5 * width, kDullSteel);
  }

  void add(const Ball&) {
    rod(tip_, end_, radius_, kSteel);
    shaft(end_, 0.4 * radius_, kDullSteel);
  }
  void add(const Grasper&) {
    const Vector3d hinge = tool_.axis_mm.isZero(0) ? Vector3d(end_ + 3.2 * radius_ * along_) : end_;
    const Vector3d tips = tip_ - 0.9 * radius_ * (hinge - tip_).normalized();
    jaws(hinge, tips, (0.3 + 1.1 * open_) * radius_, 0.55 * radius_, 0.28 * radius_);
    shaft(hinge, 0.65 * radius_, kDullSteel);
  }
  void add(const Blade& blade) {
    if (blade.cut_width_mm > 0)
      hook(blade.cut_width_mm);
    else
      scalpel();
  }
  // The edge is what cuts; its back rises to the handle.
  void scalpel() {
    const Vector3d edge = tool_.axis_mm.normalized(), back = across(edge, wanted_);
    const double width = std::clamp(0.2 * tool_.axis_mm.norm(), 0.5, 6.0);
    const double thick = std::min(radius_, 0.5 * width);
    const Vector3d heel = end_ + width * back;
    plate({tip_, end_, heel}, thick);
    const Vector3d neck = end_ + 0.5 * width * back + width * edge;
    plate({end_, heel, neck}, thick);
    rod(neck, neck, 1.3 * thick, kDullSteel);
    shaft(neck, std::max(1.2, 1.5 * thick), kDullSteel);
  }
  // A bare wire with a foot, out of an insulated sleeve.
  void hook(double width_mm) {
    const Vector3d edge = tool_.axis_mm.normalized(), foot = across(edge, wanted_);
    rod(tip_, end_, radius_, kSteel);
    rod(tip_, tip_ + 2 * width_mm * foot, radius_, kSteel);
    rod(tip_ + 0.65 * tool_.axis_mm, end_, 2.2 * radius_, kInsulation);
    shaft(end_, 3 * radius_, kInsulation);
  }
  void add(const Scissors& scissors) {
    const Vector3d forward = (tip_ - end_).normalized(), apart = across(forward, wanted_);
    const double bulge = std::max(1.5 * radius_, 0.09 * tool_.axis_mm.norm());
    for (const double side : {-1.0, 1.0}) {
      const Vector3d point = tip_ + 0.5 * side * scissors.opening_mm;
      const Vector3d out = end_ + 0.35 * (point - end_) + side * bulge * apart;
      plate({end_, point, out}, 0.8 * radius_);
    }
    rod(end_, end_, bulge, kDullSteel);
    shaft(end_, std::max(1.8, 2 * radius_), kDullSteel);
  }
  void add(const Needle&) {
    rod(tip_, end_, radius_, kSteel);
    const double length = 8 + 2 * radius_;
    const Vector3d held = end_ - 0.04 * tool_.axis_mm, hinge = held + length * along_;
    const Vector3d needle = tool_.axis_mm.normalized();
    const Vector3d gap = (radius_ + 0.5) * across(along_, along_.cross(needle));
    const Vector3d wide = 1.1 * across(along_, needle), beyond = 1.2 * along_;
    for (const Vector3d& side : {Vector3d(-gap), gap})
      plate({hinge, held + side - wide - beyond, held + side + wide - beyond}, 0.55);
    rod(hinge, hinge, 1.7, kDullSteel);
    shaft(hinge, 2, kDullSteel);
  }

  const Instrument& tool_;
  const Vector3d tip_, end_;
  const double radius_;
  const Vector3d trocar_, along_, aside_, wanted_;
  const double open_;
  std::vector<Solid> parts_;
};

std::vector<const Bundle*> bundles_of(const Player& player) {
  std::vector<const Bundle*> bundles;
  for (std::size_t o = 0; o < player.organ_count(); ++o) bundles.push_back(&player.bundle(o));
  return bundles;
}

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
  for (Solid part : ToolDrawing(tool, hold).draw()) {
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
      held.towards = 2 * bounds(player.bundle().proxy).diagonal() * path.shaft->stableNormalized();
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
