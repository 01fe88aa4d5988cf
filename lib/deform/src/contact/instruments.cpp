// SPDX-License-Identifier: Apache-2.0
#include "contact/instruments.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/reach.h"

namespace organbake::deform {
namespace {

constexpr double kPieceOfRadius =
    0.5;  // a piece this long cannot bring the centre through the skin
constexpr int kMostPieces = 2048;

std::string describe(const Eigen::Vector3d& p) {
  std::string text = "(";
  return text + to_text(p.x()) + ", " + to_text(p.y()) + ", " + to_text(p.z()) + ")";
}

bool same_tip(const InstrumentTip& a, const InstrumentTip& b) {
  if (!a.active && !b.active) return true;
  return a.active == b.active && a.mode == b.mode && a.radius_mm == b.radius_mm &&
         a.position_mm == b.position_mm && a.axis_mm == b.axis_mm &&
         a.cut_width_mm == b.cut_width_mm && a.opening_mm == b.opening_mm;
}

void check_sharp(const InstrumentTip& tip, const std::string& name) {
  if (!(tip.axis_mm.norm() >= kShortestBlade_mm)) {
    throw UsageError(name + " cuts or pierces and has the axis " + describe(tip.axis_mm) +
                     " mm; give its blade's edge or its needle, from the tip to the upper end, or "
                     "from the tips of scissors to their pivot, of 0.1 mm at least");
  }
  if (!within_reach(tip.opening_mm)) {
    throw UsageError(name + " has the opening " + describe(tip.opening_mm) +
                     " mm; give a finite one within 1e9 mm, zero for closed scissors");
  }
  if (!(tip.cut_width_mm >= 0 && tip.cut_width_mm <= kWidestCut_mm)) {
    throw UsageError(name + " cuts " + to_text(tip.cut_width_mm) + " mm wide; it must be 0 to " +
                     to_text(kWidestCut_mm));
  }
}

}  // namespace

void check_tips(const std::vector<InstrumentTip>& tips) {
  if (tips.size() > kMostTips) {
    throw UsageError("there are " + std::to_string(tips.size()) + " instrument tips; " +
                     std::to_string(kMostTips) + " at most are followed");
  }
  for (std::size_t i = 0; i < tips.size(); ++i) {
    const InstrumentTip& tip = tips[i];
    if (!tip.active) continue;
    const std::string name = "instrument tip " + std::to_string(i);
    if (!within_reach(tip.position_mm)) {
      throw UsageError(name + " is at " + describe(tip.position_mm) +
                       " mm; give a finite position within 1e9 mm");
    }
    if (!within_reach(tip.axis_mm)) {
      throw UsageError(name + " has the axis " + describe(tip.axis_mm) +
                       " mm; give a finite one within 1e9 mm, zero for a sphere");
    }
    if (!(tip.radius_mm >= kThinnestTip_mm) || tip.radius_mm > kFarthest_mm) {
      throw UsageError(name + " has radius " + to_text(tip.radius_mm) + " mm; it must be " +
                       to_text(kThinnestTip_mm) + " to 1e9");
    }
    if (tip.mode < InstrumentMode::poke || tip.mode > InstrumentMode::pierce) {
      throw UsageError(name + " has an unknown mode; use poke, grab, cut, snip or pierce");
    }
    if (!is_blunt(tip.mode)) check_sharp(tip, name);
  }
}

bool Instruments::unchanged(const std::vector<InstrumentTip>& tips) const {
  const InstrumentTip absent;
  for (std::size_t i = 0; i < std::max(tips.size(), last_.size()); ++i) {
    if (!same_tip(i < tips.size() ? tips[i] : absent, i < last_.size() ? last_[i] : absent)) {
      return false;
    }
  }
  return true;
}

std::vector<TipSweep> Instruments::advance(const std::vector<InstrumentTip>& tips,
                                           std::vector<Contact>& contacts,
                                           std::vector<std::size_t>& closing) {
  std::vector<TipSweep> sweeps;
  closing.clear();
  const auto goes_on = [&](std::size_t i) {
    return i < tips.size() && i < last_.size() && tips[i].active && last_[i].active &&
           tips[i].mode == last_[i].mode;
  };
  std::erase_if(contacts, [&](const Contact& c) { return !c.of_tissue() && !goes_on(c.tip); });
  for (std::size_t i = 0; i < tips.size(); ++i) {
    if (!tips[i].active || has_blade(tips[i].mode)) continue;
    TipSweep sweep;
    sweep.tip = static_cast<std::uint32_t>(i);
    sweep.to = to_row(tips[i].position_mm);
    sweep.just_placed = !goes_on(i);
    sweep.from = sweep.just_placed ? sweep.to : to_row(last_[i].position_mm);
    sweep.axis_to = to_row(tips[i].axis_mm);
    sweep.axis_from = sweep.just_placed ? sweep.axis_to : to_row(last_[i].axis_mm);
    sweep.radius_mm = tips[i].radius_mm;
    sweep.grabs = tips[i].mode == InstrumentMode::grab;
    sweep.pierces = tips[i].mode == InstrumentMode::pierce;
    if (sweep.grabs && sweep.just_placed) closing.push_back(sweeps.size());
    sweeps.push_back(sweep);
  }
  last_ = tips;
  return sweeps;
}

SweepPieces sweep_pieces(const std::vector<TipSweep>& sweeps) {
  double most = 1;
  for (const TipSweep& s : sweeps) {
    const double way_mm = std::max(s.motion(0).norm(), s.motion(1).norm());
    if (!s.grabs) most = std::max(most, way_mm / (kPieceOfRadius * s.radius_mm));
  }
  return {static_cast<int>(std::ceil(std::min<double>(most, kMostPieces))), most <= kMostPieces};
}

}  // namespace organbake::deform
