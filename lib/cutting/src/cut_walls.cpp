// SPDX-License-Identifier: Apache-2.0
// The walls of a cut: triangles of the sheet's two sides within each tetrahedron, with the look of
// the tissue's inside.
#include "cut_walls.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

namespace organbake {
namespace {

// −1…1, of a cell of a regular grid.
double cell_value(std::int64_t x, std::int64_t y, std::int64_t z) {
  std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15u ^
                    static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4Fu ^
                    static_cast<std::uint64_t>(z) * 0x165667B19E3779F9u;
  h ^= h >> 31, h *= 0xBF58476D1CE4E5B9u, h ^= h >> 29, h *= 0x94D049BB133111EBu, h ^= h >> 32;
  return static_cast<double>(h >> 11) * 0x1p-52 - 1;
}

}  // namespace

double tissue_noise(const Eigen::Vector3d& at) {
  std::int64_t cell[3];
  double t[3];
  for (int c = 0; c < 3; ++c) {
    const double floor = std::floor(at[c]), share = at[c] - floor;
    cell[c] = static_cast<std::int64_t>(floor);
    t[c] = share * share * (3 - 2 * share);
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    std::int64_t place[3];
    for (int c = 0; c < 3; ++c) {
      const int far = corner >> c & 1;
      place[c] = cell[c] + far;
      weight *= far ? t[c] : 1 - t[c];
    }
    sum += weight * cell_value(place[0], place[1], place[2]);
  }
  return sum;
}

namespace {

constexpr double kCapsule_mm = 0.35;
// Below the lips a fresh cut is wet with blood, and little light comes down between them.
constexpr double kWet_mm = 2.2;
constexpr float kWetDarkness = 0.72f;
const Eigen::Vector3f kCapsule(0.60f, 0.40f, 0.32f);  // connective tissue with little blood

}  // namespace

double from_vessel_mm(const Eigen::Vector3d& at_mm) {
  constexpr double kCube_mm = 7, kNone = -0.2, kMean_mm = 0.85, kSpread_mm = 0.45;
  const Eigen::Vector3d cube = (at_mm / kCube_mm).array().floor();
  const auto chance = [&](std::int64_t which) {
    return cell_value(std::int64_t(cube.x()), std::int64_t(cube.y()),
                      std::int64_t(cube.z()) + 1000003 * which);
  };
  if (chance(1) < kNone) return kCube_mm;
  const Eigen::Vector3d off(chance(2), chance(3), chance(4));
  Eigen::Vector3d away = at_mm - kCube_mm * (cube + 0.2 * off + Eigen::Vector3d::Constant(0.5));
  away[static_cast<int>(1.5 * (1 + chance(5))) % 3] *= 0.5;
  return away.norm() - (kMean_mm + kSpread_mm * chance(6));
}

namespace {

// 1 on the seams between lobules of about that size, 0 within: where a noise passes through 0.
float seam_at(const Eigen::Vector3d& at_mm, double size_mm) {
  return static_cast<float>(std::exp(-20 * std::pow(tissue_noise(at_mm / size_mm), 2)));
}

// Of fat, which is yellow: lobules between seams. Of parenchyma: fine pale seams, and vessels, dark
// with blood within a pale wall.
Eigen::Vector3f structured(const Eigen::Vector3f& inner, const Eigen::Vector3d& at_mm) {
  if (inner.z() < 0.6f * inner.y()) return (1 - 0.45f * seam_at(at_mm, 4)) * inner;
  const Eigen::Vector3f blood(0.035f, 0.003f, 0.003f), wall = 0.3f * (kCapsule + inner);
  const double off_mm = from_vessel_mm(at_mm);
  const auto lumen = static_cast<float>(std::clamp(0.5 - 4 * off_mm, 0.0, 1.0)),
             ring = static_cast<float>(std::clamp(1.5 - 4 * off_mm, 0.0, 1.0));
  const Eigen::Vector3f grained = (1 + 0.25f * seam_at(at_mm, 1.6)) * inner;
  return lumen * blood + (1 - lumen) * (ring * wall + (1 - ring) * grained);
}

}  // namespace

Eigen::Vector3f inner_albedo(const Eigen::Vector3d& at_mm, double depth_mm,
                             const Eigen::Vector3f& skin_albedo, bool alive) {
  const double mottled = 0.5 * tissue_noise(at_mm / 6.0) + 0.3 * tissue_noise(at_mm / 2.3) +
                         0.2 * tissue_noise(at_mm / 1.1);
  const double fibres = tissue_noise({at_mm.x() / 1.4, at_mm.y() / 7.0, at_mm.z() / 1.4});
  const auto light = static_cast<float>(0.66 * (1 + 0.45 * mottled + 0.25 * fibres));
  const auto wet = static_cast<float>(std::exp(-std::pow(depth_mm / kWet_mm, 2)));
  Eigen::Vector3f inner = light * skin_albedo.cwiseProduct(Eigen::Vector3f(1.0f, 0.62f, 0.62f));
  if (alive) inner = structured(inner, at_mm);
  inner *= 1 - kWetDarkness * wet;
  // Right below the skin lies its pale capsule, here thinner, there thicker.
  const double capsule_mm = kCapsule_mm * (1 + 0.5 * tissue_noise(at_mm / 2.5));
  const auto pale = static_cast<float>(std::exp(-std::pow(depth_mm / capsule_mm, 2)));
  return (1 - 0.4f * pale) * inner + 0.2f * pale * (skin_albedo + kCapsule);
}

namespace {

using Eigen::Vector3d;

constexpr int kDown = 4;            // quadrangles from the lips to the bottom
constexpr double kAside_mm = 0.05;  // from the cut into the tissue
constexpr double kFarAside_mm = 0.5;
constexpr double kFarthestEnd_mm = 12;  // of a cut's end from where its lips come together
constexpr double kBelowSkin_mm = 1.5;
constexpr double kAlongEdge = 1e-3;    // sine of the angle between the blade's edge and the skin
constexpr double kFarthestBeside = 2;  // lines or rows: a blade that left farther off tells nothing
constexpr double kDimHole = 0.5;       // of a hole's rim
constexpr double kCorner = 0.5;        // cosine of the angle from which walls turn a corner
constexpr double kOpposite = -0.99;    // cosine below which two are a cut's sides at its end
constexpr double kShort_mm = 0.2;      // a piece of border that tells no way
constexpr double kFlat = 2;  // times as much a blade moved into the skin as it stood in it

// How walls run down a stroke: along the blade's edge to its tip; or, of a blade that came down
// flat on the skin, on from line to line as it went deeper. `height` falls on the way down.
struct WayDown {
  bool by_lines = false;
  double lowest = 1;

  double height(const SheetPlace& p) const { return by_lines ? -p.line : p.row; }
  double beside(const SheetPlace& p) const { return by_lines ? p.row : p.line; }
  void set_height(double h, SheetPlace& p) const {
    (by_lines ? p.line : p.row) = by_lines ? -h : h;
  }
  void set_beside(double b, SheetPlace& p) const { (by_lines ? p.row : p.line) = b; }
};

class WallMaker {
 public:
  WallMaker(const CutSkin& skin, const CutSheet& sheet) : skin_(skin), sheet_(sheet) {}

  CutWalls make() {
    find_ways_down();
    for (const SkinBorder& border : skin_.borders()) {
      if (entry(border) < -kAlongEdge)
        leaving_.push_back({vertex(border.left[0]).place, vertex(border.left[1]).place});
    }
    for (const SkinBorder& border : skin_.borders()) {
      if (!(entry(border) > kAlongEdge)) continue;
      const Vector3d outward = outward_from_left(border);
      const Vector3d facing = facing_of(border, outward);
      const Column from = column(border.left[0], outward, facing),
                   to = column(border.left[1], outward, facing),
                   back_from = column(border.right[1], -outward, -facing),
                   back_to = column(border.right[0], -outward, -facing);
      add_wall(from, to);
      add_wall(back_from, back_to);
      add_floor(border, {from, to}, {back_to, back_from});
      if (border.left[0] == border.right[0]) add_end(border, 0, outward, from, back_to);
      if (border.left[1] == border.right[1]) add_end(border, 1, outward, to, back_from);
    }
    return std::move(walls_);
  }

 private:
  using Column = std::array<std::uint32_t, kDown + 1>;

  const CutSkin::Vertex& vertex(std::uint32_t v) const { return skin_.vertices()[v]; }

  // Of a place on a stroke, per unit of the way's height.
  Vector3d upward(const SheetPlace& place) const {
    return ways_[place.stroke].by_lines ? Vector3d(-sheet_.onward(place)) : sheet_.upward(place);
  }

  // By what most of a stroke's borders say.
  void find_ways_down() {
    ways_.resize(sheet_.strokes().size());
    std::vector<double> stands(ways_.size(), 0), moves(ways_.size(), 0);
    for (const SkinBorder& border : skin_.borders()) {
      const SheetPlace& place = vertex(border.left[0]).place;
      const Vector3d normal = skin_.normal_beside(border);
      stands[place.stroke] += std::abs(sheet_.upward(place).stableNormalized().dot(normal));
      moves[place.stroke] += std::abs(sheet_.onward(place).stableNormalized().dot(normal));
    }
    for (std::size_t s = 0; s < ways_.size(); ++s) {
      if (moves[s] > kFlat * stands[s])
        ways_[s] = {true, 1 - static_cast<double>(sheet_.strokes()[s].size())};
    }
  }

  // How the way down stands on the skin: 1 where the blade came in square, −1 where it left; next
  // to nothing where the border runs along the way.
  double entry(const SkinBorder& border) const {
    const Vector3d up = upward(vertex(border.left[0]).place);
    return up.normalized().dot(skin_.normal_beside(border));
  }

  // Across the sheet, away from the tissue on the border's left.
  Vector3d outward_from_left(const SkinBorder& border) const {
    const Vector3d across = sheet_.across(vertex(border.left[0]).place);
    // The left part lies on the left of its border, seen from outside.
    const Vector3d along = vertex(border.left[1]).on_cut_mm() - vertex(border.left[0]).on_cut_mm();
    const Vector3d to_left = skin_.normal_beside(border).cross(along);
    return to_left.dot(across) < 0 ? across : Vector3d(-across);
  }

  // Which way the wall below a border faces, `outward` of it: square to the border itself, unless
  // that is too short to tell.
  Vector3d facing_of(const SkinBorder& border, const Vector3d& outward) const {
    const CutSkin::Vertex &from = vertex(border.left[0]), &to = vertex(border.left[1]);
    const Vector3d along = to.on_cut_mm() - from.on_cut_mm();
    return along.norm() < kShort_mm ? outward : along.cross(upward(from.place)).normalized();
  }

  std::uint32_t add_vertex(const CutWalls::Vertex& vertex) {
    walls_.vertices.push_back(vertex);
    return static_cast<std::uint32_t>(walls_.vertices.size() - 1);
  }

  // Little light falls into a hole as long as it is wide, which nothing pulls open as a cut.
  float light_in_hole(std::uint32_t stroke, double depth_mm) const {
    if (!sheet_.is_hole(stroke)) return 1;
    const double deep = depth_mm / sheet_.width_mm(stroke);
    return static_cast<float>(kDimHole / (1 + deep * deep));
  }

  // The height at which the blade ends, or leaves the tissue, below a place.
  double bottom(const SheetPlace& place) const {
    const WayDown& way = ways_[place.stroke];
    double lowest = way.lowest, nearest = kFarthestBeside;
    for (const auto& [a, b] : leaving_) {
      if (a.stroke != place.stroke || b.stroke != place.stroke) continue;
      const double from = way.beside(a), to = way.beside(b), here = way.beside(place);
      const double low = std::min(from, to), high = std::max(from, to);
      const double away = std::max({low - here, here - high, 0.0});
      const double share = high > low ? std::clamp((here - from) / (to - from), 0.0, 1.0) : 0.5;
      const double there = way.height(a) + share * (way.height(b) - way.height(a));
      if (there >= way.height(place) || away > nearest || (away == nearest && there <= lowest))
        continue;
      nearest = away, lowest = there;
    }
    return std::min(lowest, way.height(place));
  }

  // A lip has one for each way that its walls face: where they turn a corner each keeps its own
  // normals. The tissue that carries them is the same, so that nothing opens between them; but not
  // where a cut ends, whose two sides hang on that lip.
  Column column(std::uint32_t lip, const Vector3d& outward, const Vector3d& facing) {
    std::vector<Side>& sides = columns_[lip];
    for (const Side& side : sides)
      if (side.facing.dot(facing) > kCorner) return side.column;
    const auto own = std::find_if(sides.begin(), sides.end(), [&](const Side& side) {
      return side.outward.dot(outward) > kOpposite;
    });
    const Vector3d away = own != sides.end() ? own->outward : outward;
    Column& column = sides.emplace_back(Side{outward, facing, {}}).column;
    const SheetPlace& place = vertex(lip).place;
    const WayDown& way = ways_[place.stroke];
    const double top = way.height(place), fall = bottom(place) - top;
    for (int k = 0; k <= kDown; ++k) {
      // Where cuts cross, the lip tells better than the wall where its tissue lies.
      const Vector3d of_lip = vertex(lip).side_mm - vertex(lip).at_mm;
      const Vector3d aside = k == 0 || of_lip.norm() > kFarAside_mm ? of_lip : -kAside_mm * away;
      SheetPlace here = place;
      way.set_height(top + fall * k / kDown, here);
      CutWalls::Vertex made_here;
      made_here.lip = lip;
      made_here.at_mm = k == 0 ? vertex(lip).at_mm : sheet_.at(here) + vertex(lip).drawn_back_mm;
      made_here.side_mm = made_here.at_mm + aside;
      made_here.depth_mm = (made_here.at_mm - vertex(lip).at_mm).norm();
      made_here.light = light_in_hole(place.stroke, made_here.depth_mm);
      column[k] = add_vertex(made_here);
    }
    return column;
  }

  // Between two columns, below a border that runs with its tissue to the left.
  void add_wall(const Column& a, const Column& b) {
    for (int k = 0; k < kDown; ++k) {
      walls_.faces.push_back({a[k + 1], b[k + 1], b[k]});
      walls_.faces.push_back({a[k + 1], b[k], a[k]});
    }
  }

  // Where the blade took tissue away its walls stand apart, and its tip leaves a floor between.
  void add_floor(const SkinBorder& border, const std::array<Column, 2>& left,
                 const std::array<Column, 2>& right) {
    double widest_mm = 0;  // where strokes cross, of either
    for (const std::uint32_t lip : border.left) {
      const SheetPlace& place = vertex(lip).place;
      if (bottom(place) > ways_[place.stroke].lowest) return;
      widest_mm = std::max(widest_mm, sheet_.width_mm(place.stroke));
    }
    if (widest_mm == 0) return;
    const auto below = [&](const Column& column) {
      const auto [at, made] = floor_.try_emplace(column[kDown]);
      if (made) at->second = add_vertex(CutWalls::Vertex(walls_.vertices[column[kDown]]));
      return at->second;
    };
    const std::uint32_t a = below(left[0]), b = below(left[1]);
    const std::uint32_t c = below(right[0]), d = below(right[1]);
    walls_.faces.push_back({a, d, b});
    walls_.faces.push_back({a, c, d});
  }

  // Below the skin that holds together at a border's end the cut goes on.
  void add_end(const SkinBorder& border, int end, const Vector3d& outward, const Column& left,
               const Column& right) {
    const SheetPlace& place = vertex(border.left[end]).place;
    const SheetPlace& other = vertex(border.left[1 - end]).place;
    const WayDown& way = ways_[place.stroke];
    if (other.stroke != place.stroke || way.beside(other) == way.beside(place)) return;
    const Vector3d here = sheet_.at(place);
    const double first = way.by_lines ? 1 : 0;
    const double last = way.by_lines
                            ? BladeLine::kPoints
                            : static_cast<double>(sheet_.strokes()[place.stroke].size() - 1);
    const double step = way.beside(place) > way.beside(other) ? 1 : -1;
    SheetPlace beyond = place;
    while (way.beside(beyond) + step >= first && way.beside(beyond) + step <= last &&
           (sheet_.at(beyond) - here).norm() < kFarthestEnd_mm)
      way.set_beside(way.beside(beyond) + step, beyond);
    const double per_unit = upward(beyond).norm();
    if (per_unit > 0) way.set_height(way.height(beyond) - kBelowSkin_mm / per_unit, beyond);
    const double top = way.height(beyond), fall = std::min(bottom(place), top) - top;
    std::array<Column, 2> ends;
    for (int side = 0; side < 2; ++side) {
      for (int k = 0; k <= kDown; ++k) {
        SheetPlace at = beyond;
        way.set_height(top + fall * k / kDown, at);
        const Vector3d point = sheet_.at(at);
        ends[side][k] = add_vertex({point, point + (side == 0 ? -kAside_mm : kAside_mm) * outward,
                                    side == 0 ? border.left[end] : border.right[end],
                                    kBelowSkin_mm + (point - sheet_.at(beyond)).norm()});
      }
    }
    if (end == 1) {
      add_wall(left, ends[0]), add_wall(ends[1], right);
    } else {
      add_wall(ends[0], left), add_wall(right, ends[1]);
    }
  }

  const CutSkin& skin_;
  const CutSheet& sheet_;
  std::vector<WayDown> ways_;                       // by stroke
  std::vector<std::array<SheetPlace, 2>> leaving_;  // borders along which blades left the tissue
  struct Side {
    Vector3d outward, facing;  // of the border that asked first
    Column column;
  };
  std::map<std::uint32_t, std::vector<Side>> columns_;  // by lip
  std::map<std::uint32_t, std::uint32_t> floor_;        // its vertices, by those above
  CutWalls walls_;
};

}  // namespace

CutWalls cut_walls(const CutSkin& skin, const CutSheet& sheet) {
  return WallMaker(skin, sheet).make();
}

}  // namespace organbake
