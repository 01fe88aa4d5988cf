// SPDX-License-Identifier: Apache-2.0
// Where blood comes from is a matter of places at rest alone, and how much of when a blade passed
// there: so it is the same for whoever plays, undoes or repeats a cut.
#include "organbake/cutting/bleeding.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "cut_walls.h"
#include "organbake/core/smooth_step.h"
#include "organbake/geometry/refine.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kOoze_mm = 0.27, kUneven = 0.5, kFromVessel_mm = 0.3;  // radii of lines
constexpr double kAtEnd = 0.4, kSealed = 0.45;
constexpr double kDeepest_mm = 10, kEvery_mm = 0.4;  // of vessels that matter, along a wall
constexpr double kRun_mm = 0.17, kHead_mm = 0.25, kLongestRun_mm = 7, kRunsAfter_s = 0.3;
constexpr double kLeast_mm = 0.02, kOfCast_mm = 0.7, kLongAgo = -1e9;  // steps
constexpr std::uint32_t kPuffEvery = 2;                                // steps
constexpr double kSmoke_s = 1.5, kPuffShare = 0.26;

bool burns(const CutSheet& sheet, std::uint32_t stroke) {
  return sheet.width_mm(stroke) > 0 && !sheet.is_hole(stroke);
}

// 0 … 1: whether the blade cut a vessel below a place on the skin.
double vessel_below(const CutSheet& sheet, const SheetPlace& place) {
  const Vector3d skin = sheet.at(place);
  const double per_row = sheet.upward(place).norm();
  double vessel = 0;
  if (!(per_row > 0)) return 0;
  for (SheetPlace at = place; at.row >= 1; at.row -= kEvery_mm / per_row) {
    const Vector3d here = sheet.at(at);
    if ((here - skin).norm() > kDeepest_mm) break;
    vessel = std::max(vessel, std::clamp(0.5 - 2 * from_vessel_mm(here), 0.0, 1.0));
  }
  return vessel;
}

Vector3d normal_of(const Face& corners, const std::vector<Vector3d>& at_mm) {
  const auto& [a, b, c] = corners;
  return (at_mm[b] - at_mm[a]).cross(at_mm[c] - at_mm[a]).stableNormalized();
}

double chance(const SheetPlace& place, int which) {
  return tissue_noise({double(place.stroke), place.line, double(which)});
}

// How far blood has welled up.
double welled(double age_s, double from_s = 0) {
  return smooth_step(from_s, Bleeding::kWelling_s, age_s);
}

}  // namespace

Vector3d Bleeding::Bound::at(const std::vector<Vector3d>& positions_mm) const {
  return weights[0] * positions_mm[corners[0]] + weights[1] * positions_mm[corners[1]] +
         weights[2] * positions_mm[corners[2]];
}

Vector3d Bleeding::Bound::outward(const std::vector<Vector3d>& positions_mm) const {
  return normal_of(corners, positions_mm);
}

Bleeding::Bleeding(const CutSkin& skin, const CutSheet& sheet, const TriangleMesh& proxy,
                   const std::vector<LipGape::Border>& lips, std::span<const LipGape::Wall> walls,
                   const std::optional<Vector3d>& down) {
  std::map<std::uint32_t, std::uint32_t> below;  // by lip, half-way down
  for (std::size_t w = 0; w < walls.size(); ++w)
    if (std::abs(walls[w].down - 0.5) < 0.2)
      below.emplace(walls[w].lip, static_cast<std::uint32_t>(skin.vertices().size() + w));
  std::set<std::uint32_t> ends;
  for (const SkinBorder& border : skin.borders())
    for (int end = 0; end < 2; ++end)
      if (border.left[end] == border.right[end]) ends.insert(border.left[end]);
  const auto well = [&](std::uint32_t v) -> Well {
    if (!down) return {kLongAgo, kOfCast_mm};
    const SheetPlace& place = skin.vertices()[v].place;
    const double uneven = 1 + kUneven * tissue_noise(skin.vertices()[v].on_cut_mm() / 1.7);
    const double share =
        (ends.contains(v) ? kAtEnd : 1) * (burns(sheet, place.stroke) ? kSealed : 1);
    return {sheet.step(place),
            share * (kOoze_mm * uneven + kFromVessel_mm * vessel_below(sheet, place))};
  };
  for (const auto& [from, to, inner] : lips) {
    const auto wall = below.find(below.contains(from) ? from : to);
    lips_.push_back(
        {{from, to, inner},
         wall == below.end() ? std::array{from, from} : std::array{wall->first, wall->second},
         {well(from), well(to)}});
    const CutSkin::Vertex &a = skin.vertices()[from], &b = skin.vertices()[to];
    if (!down || a.place.stroke != b.place.stroke || a.place.line == b.place.line) continue;
    const bool hook = burns(sheet, a.place.stroke);
    const Vector3d along = (b.at_mm - a.at_mm).stableNormalized();
    const Vector3d into = skin.vertices()[inner].at_mm - a.at_mm;
    const double falls = down->dot((into - along * along.dot(into)).stableNormalized());
    // Each line of the blade is where a run may begin: the same however a cut goes on.
    const double first = std::min(a.place.line, b.place.line);
    const double last = std::max(a.place.line, b.place.line);
    for (double line = std::floor(first) + 1; line <= last; ++line) {
      const double share = (line - a.place.line) / (b.place.line - a.place.line);
      const SheetPlace place{a.place.stroke, line,
                             a.place.row + share * (b.place.row - a.place.row)};
      if (hook || !(falls > 0.2) || chance(place, 0) + vessel_below(sheet, place) <= 0.7) continue;
      Run& run = runs_.emplace_back();
      run.since = sheet.step(place);
      run.path[0] = {{from, to, inner}, {1 - share, share, 0}};
      run.lead(std::span(proxy.faces).first(skin.parts().size()), proxy.vertices, *down,
               kLongestRun_mm * falls * (0.6 + 0.4 * chance(place, 1)));
    }
  }
}

// From its first place down the skin, at rest.
void Bleeding::Run::lead(std::span<const Face> skin, const std::vector<Vector3d>& rest_mm,
                         const Vector3d& down, double length_mm) {
  Vector3d place = path[0].at(rest_mm);
  for (int k = 1; k <= kRunPieces; ++k) {
    const Vector3d normal = path[k - 1].outward(rest_mm);
    const Vector3d way = (down - normal * normal.dot(down)).stableNormalized();
    const double aside = k == 1 ? 0 : 0.6 * tissue_noise(place / 0.9);
    place += length_mm / kRunPieces * (way + aside * normal.cross(way)).stableNormalized();
    double nearest2 = std::numeric_limits<double>::infinity();
    for (const Face& face : skin) {
      const Bound on{
          face, nearest_on_triangle(place, rest_mm[face[0]], rest_mm[face[1]], rest_mm[face[2]])};
      const double away2 = (on.at(rest_mm) - place).squaredNorm();
      if (away2 < nearest2) nearest2 = away2, path[k] = on;
    }
    place = path[k].at(rest_mm);
  }
}

void Bleeding::add_blood(const std::vector<Vector3d>& at_mm, double step, double step_s,
                         std::vector<BloodLine>& blood) const {
  const auto age_s = [&](double since) { return (step - since) * step_s; };
  for (const Lip& lip : lips_) {
    std::array<double, 2> radius;
    for (int end = 0; end < 2; ++end)
      radius[end] = lip.ends[end].radius_mm * std::sqrt(welled(age_s(lip.ends[end].since)));
    if (std::max(radius[0], radius[1]) < kLeast_mm) continue;
    const Vector3d outward = normal_of(lip.corners, at_mm), &from = at_mm[lip.corners[0]];
    const Vector3d into = at_mm[lip.down[1]] - at_mm[lip.down[0]];
    blood.push_back({from, at_mm[lip.corners[1]], outward,
                     into.isZero(0) ? -outward : into.stableNormalized(), radius[0], radius[1]});
  }
  for (const Run& run : runs_) {
    const double reach = kRunPieces * welled(age_s(run.since), kRunsAfter_s);
    for (int k = 0; k < reach; ++k) {
      const Vector3d from = run.path[k].at(at_mm), to = run.path[k + 1].at(at_mm);
      const double share = std::min(1.0, reach - k);
      const Vector3d outward =
          (run.path[k].outward(at_mm) + run.path[k + 1].outward(at_mm)).stableNormalized();
      blood.push_back({from, from + share * (to - from), outward, -outward, kRun_mm,
                       k + 1 < reach ? kRun_mm : kHead_mm});
    }
  }
}

void add_smoke(const CutSheet& sheet, const Vector3d& up, double step, double step_s,
               std::vector<SmokePuff>& smoke) {
  for (std::uint32_t s = 0; s < sheet.strokes().size(); ++s) {
    if (!burns(sheet, s)) continue;
    const std::vector<BladeLine>& lines = sheet.strokes()[s];
    for (std::size_t l = lines.size(); l-- > 1;) {
      const double age_s = (step - lines[l].step) * step_s, left = 1 - age_s / kSmoke_s;
      if (left <= 0) break;
      if (!lines[l].skin_mm || lines[l].step / kPuffEvery == lines[l - 1].step / kPuffEvery)
        continue;
      const SheetPlace place{s, double(l), 0.5 * BladeLine::kRows};
      const Vector3d outward = sheet.upward(place).stableNormalized();
      const Vector3d drift =
          2 * Vector3d(chance(place, 2), chance(place, 3), chance(place, 4)) + 8 * up;
      // It lies on the skin: within it, it would show before a cut's far wall alone.
      const double radius = 1.5 + 5 * age_s;
      smoke.push_back({*lines[l].skin_mm + radius * outward + age_s * drift, radius,
                       kPuffShare * left * left * std::min(1.0, (age_s + 0.08) / 0.15)});
    }
  }
}

}  // namespace organbake
