// SPDX-License-Identifier: Apache-2.0
// Builds what a viewer sees of a tool from balls, rods and plates: the jaws of a grasper, a
// scalpel's blade, the wire of a hook, and the shaft to the trocar.
#include "tool_parts.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace organbake {
namespace {

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
    const Vector3d tips = tip_ - 0.55 * radius_ * (hinge - tip_).normalized();
    jaws(hinge, tips, (0.14 + 1.3 * open_) * radius_, 0.45 * radius_, 0.28 * radius_);
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

}  // namespace

std::vector<Solid> tool_parts(const Instrument& tool, const ToolHold& hold) {
  return ToolDrawing(tool, hold).draw();
}

}  // namespace organbake
