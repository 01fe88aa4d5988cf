// SPDX-License-Identifier: Apache-2.0
// An organ under blades: what was swept since the last cut parts tetrahedra, skin and what lies
// between them, and is told to whoever draws and solves.
#include "organbake/cutting/cut_organ.h"

#include <Eigen/Geometry>
#include <numeric>
#include <utility>

#include "cut_walls.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/refine.h"

namespace organbake {
namespace {

const TetrahedralBody& tetrahedra_of(const Bundle& bundle) {
  if (!bundle.mechanics.body) {
    throw UsageError("the organ '" + bundle.manifest.name +
                     "' was baked without tetrahedra and cannot be cut; bake it anew "
                     "without --set mechanics.fem=false");
  }
  return *bundle.mechanics.body;
}

SmoothSkin skin_of_itself(std::size_t vertices) {
  SmoothSkin skin;
  skin.steps = 1;
  skin.first.resize(vertices + 1);
  std::iota(skin.first.begin(), skin.first.end(), 0u);
  skin.carrier.resize(vertices);
  std::iota(skin.carrier.begin(), skin.carrier.end(), 0u);
  skin.weight.assign(vertices, 1.0);
  return skin;
}

// Whose motion each vertex of the uncut skin follows, and by which shares: the proxy's vertices'.
std::vector<std::vector<NodeShare>> carriers_of(const Bundle& bundle) {
  std::vector<std::vector<NodeShare>> carriers;
  if (!bundle.skin) {
    for (std::uint32_t v = 0; v < bundle.proxy.vertices.size(); ++v) carriers.push_back({{v, 1}});
    return carriers;
  }
  const SmoothSkin& skin = *bundle.skin;
  for (std::size_t n = 0; n < skin.node_count(); ++n) {
    std::vector<NodeShare>& own = carriers.emplace_back();
    for (std::uint32_t k = skin.first[n]; k < skin.first[n + 1]; ++k)
      own.push_back({skin.carrier[k], skin.weight[k]});
  }
  return carriers;
}

void add_shares(const std::vector<NodeShare>& shares, double by, std::vector<NodeShare>& sum) {
  for (const auto& [node, weight] : shares) {
    const auto known = std::find_if(sum.begin(), sum.end(),
                                    [n = node](const NodeShare& share) { return share.node == n; });
    if (known == sum.end()) {
      sum.push_back({node, by * weight});
    } else {
      known->weight += by * weight;
    }
  }
}

std::vector<LipGape::Wall> ways_down(const CutWalls& walls) {
  std::map<std::uint32_t, double> deepest_mm;  // by lip
  for (const CutWalls::Vertex& v : walls.vertices) {
    double& deepest = deepest_mm[v.lip];
    deepest = std::max(deepest, v.depth_mm);
  }
  std::vector<LipGape::Wall> ways;
  for (const CutWalls::Vertex& v : walls.vertices) {
    const double deepest = deepest_mm[v.lip];
    ways.push_back({v.lip, deepest > 0 ? v.depth_mm / deepest : 0});
  }
  return ways;
}

// How far vertices of the skin lie from lips, as far as two faces reach.
std::map<std::uint32_t, double> from_lips(const CutSkin& skin) {
  const std::vector<CutSkin::Vertex>& vertices = skin.vertices();
  std::map<std::uint32_t, double> away_mm;
  const auto take = [&](std::uint32_t v, double mm) {
    double& least = away_mm.try_emplace(v, mm).first->second;
    least = std::min(least, mm);
  };
  for (const SkinPart& part : skin.parts())
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = part.corners[k];
      std::array<std::uint32_t, 2> lip = {part.corners[(k + 1) % 3], part.corners[(k + 2) % 3]};
      if (vertices[v].on_border) lip = {v, v};
      if (!vertices[lip[0]].on_border) lip[0] = lip[1];
      if (!vertices[lip[0]].on_border) continue;
      if (!vertices[lip[1]].on_border) lip[1] = lip[0];
      const Eigen::Vector3d &from = vertices[lip[0]].at_mm, &to = vertices[lip[1]].at_mm;
      const Eigen::Vector3d w = nearest_on_triangle(vertices[v].at_mm, from, to, to);
      take(v, (w[0] * from + (w[1] + w[2]) * to - vertices[v].at_mm).norm());
    }
  const std::map<std::uint32_t, double> near_mm = away_mm;
  for (const SkinPart& part : skin.parts())
    for (const std::uint32_t v : part.corners)
      for (const std::uint32_t other : part.corners)
        if (const auto known = near_mm.find(other); known != near_mm.end() && !near_mm.contains(v))
          take(v, known->second + (vertices[v].at_mm - vertices[other].at_mm).norm());
  return away_mm;
}

}  // namespace

CutOrgan::CutOrgan(const Bundle& bundle)
    : base_(bundle.base),
      lighting_(bundle.lighting),
      skin_(bundle.shell().at_rest()),
      carriers_(carriers_of(bundle)),
      body_(tetrahedra_of(bundle)),
      fine_skin_(skin_, body_.grid(), body_.first_free_rank()),
      inside_(skin_, body_.grid(),
              body_.first_free_rank() + static_cast<std::uint32_t>(skin_.vertices.size())) {
  now_.manifest = bundle.manifest;
  now_.cameras = bundle.cameras;
  now_.lighting = bundle.lighting;
  now_.mechanics = bundle.mechanics;
  now_.mechanics.springs.clear();
  now_.mechanics.elimination_order.clear();
  if (base_.color.empty()) return;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const std::uint32_t nodes = base_.nodes_per_face();
  for (std::size_t i = 0; i < base_.color.size(); ++i) {
    Eigen::Vector3d color = base_.color[i].cast<double>();
    if (lighting_) {
      const Eigen::Vector3d light = lighting_->diffuse(face_normal(skin_, i / nodes));
      color = color.cwiseQuotient(light.cwiseMax(0.05));
    }
    sum += color;
  }
  mean_albedo_ = (sum / double(base_.color.size())).cast<float>().cwiseMin(1).cwiseMax(0);
}

// Its points' ranks follow those of the skin, and of what is asked about it.
CutSheet CutOrgan::clean_sheet() const {
  return {body_.grid(),
          body_.first_free_rank() + 2 * static_cast<std::uint32_t>(skin_.vertices.size()) + 2};
}

bool CutOrgan::part(const CutSheet& sheet) {
  const std::span all(sheet.triangles());
  const std::size_t first_new = std::exchange(taken_, all.size());
  const bool skin_cut = fine_skin_.add(all, first_new);
  const bool body_cut = body_.add(all, first_new);
  if (!skin_cut && !body_cut) return false;
  cut_ = true;
  remake(sheet);
  return true;
}

// The lattices of two base layers, and what lies about each vertex and tetrahedron, in a few dozen
// lists.
std::size_t CutOrgan::bytes() const {
  constexpr std::size_t kPerNode = sizeof(float) + sizeof(Eigen::Vector3f) + sizeof(std::uint32_t);
  constexpr std::size_t kPerVertex = 500, kPerTetrahedron = 500;
  return kPerNode * (base_.height_mm.size() + now_.base.height_mm.size()) +
         kPerVertex * (skin_.vertices.size() + now_.proxy.vertices.size()) +
         kPerTetrahedron * body_.cut().copies().size();
}

void CutOrgan::remake(const CutSheet& sheet) {
  const CutSkin skin(fine_skin_.mesh(), fine_skin_.edges(), sheet);
  const CutWalls walls = cut_walls(skin, sheet);
  now_.proxy = {};
  for (const CutSkin::Vertex& v : skin.vertices()) now_.proxy.vertices.push_back(v.at_mm);
  for (const CutWalls::Vertex& v : walls.vertices) now_.proxy.vertices.push_back(v.at_mm);
  for (const SkinPart& part : skin.parts()) now_.proxy.faces.push_back(part.corners);
  const auto first = static_cast<std::uint32_t>(skin.vertices().size());
  for (const auto& [a, b, c] : walls.faces)
    now_.proxy.faces.push_back({first + a, first + b, first + c});
  now_.skin = skin_of_itself(now_.proxy.vertices.size());
  now_.skin->creased.assign(now_.proxy.vertices.size(), 1);
  for (std::size_t v = 0; v < skin.vertices().size(); ++v)
    now_.skin->creased[v] = skin.vertices()[v].on_border;
  remake_face_parts(skin);
  remake_body(places_of(skin, walls));
  const std::vector<LipGape::Wall> down = ways_down(walls);
  remake_give(skin, down);
  remake_base(walls);
  gape_ = LipGape(skin, down, now_.mechanics.cut_gape_mm);
  bleeding_ = Bleeding(skin, sheet, now_.proxy, gape_.borders(), down,
                       alive() ? std::optional<Eigen::Vector3d>(-lighting_->up) : std::nullopt);
}

// A face that was neither halved nor cut, and has no lip near, is itself and is not told.
void CutOrgan::remake_face_parts(const CutSkin& skin) {
  face_parts_.clear();
  const std::map<std::uint32_t, double> away_mm = from_lips(skin);
  for (std::uint32_t number = 0; number < skin.parts().size(); ++number) {
    const SkinPart& part = skin.parts()[number];
    const FineSkin::Part& fine = fine_skin_.parts()[part.face];
    FacePart whole{number, {}};
    bool near = true;
    for (int k = 0; k < 3; ++k) {
      whole.at[k] = within(fine.at, part.at[k]);
      const auto known = away_mm.find(part.corners[k]);
      near = near && known != away_mm.end();
      if (near) whole.from_lip_mm[k] = known->second;
    }
    if (!near) whole.from_lip_mm.fill(FacePart::kAny_mm);
    if (near || whole.at != kCornersInFace) face_parts_[fine.face].push_back(whole);
  }
}

// Of the vertices of the skin, then of the walls. A border's may be carried with its corner, a
// wall's with its lip, whose places come first.
std::vector<TissuePlace> CutOrgan::places_of(const CutSkin& skin, const CutWalls& walls) const {
  const std::size_t lips = skin.vertices().size();
  std::vector<TissuePlace> places(lips + walls.vertices.size());
  const std::size_t uncut = fine_skin_.mesh().vertices.size();
  const auto place_on_skin = [&](std::size_t i) {
    const CutSkin::Vertex& v = skin.vertices()[i];
    places[i] = body_.place(v.at_mm, v.side_mm, v.on_border ? &places[v.corner] : nullptr);
  };
  parallel_for(std::size_t{0}, uncut, place_on_skin);
  parallel_for(uncut, lips, place_on_skin);
  parallel_for(lips, places.size(), [&](std::size_t i) {
    const CutWalls::Vertex& v = walls.vertices[i - lips];
    places[i] = body_.place(v.at_mm, v.side_mm, &places[v.lip]);
  });
  return places;
}

void CutOrgan::remake_body(const std::vector<TissuePlace>& places) {
  const CutTetrahedra& cut = body_.cut();
  const TetrahedralBody& uncut = body_.uncut();
  TetrahedralBody& body = *now_.mechanics.body;
  std::vector<std::uint8_t> anchored(uncut.nodes_mm.size(), 0);
  for (const std::uint32_t n : uncut.anchors) anchored[n] = 1;
  body.nodes_mm.clear(), body.anchors.clear(), body.tetrahedra.clear(), body.vertices.clear();
  body.patches.clear();
  for (std::uint32_t n = 0; n < cut.node_count(); ++n) {
    body.nodes_mm.push_back(uncut.nodes_mm[cut.original(n)]);
    // What is cut off an anchor is free.
    if (n < uncut.nodes_mm.size() && anchored[n]) body.anchors.push_back(n);
  }
  constexpr double kLeastShare = 0.02;  // less would be flung about
  for (const CutTetrahedra::Copy& copy : cut.copies()) {
    const double fill = uncut.tetrahedra[copy.tetrahedron].fill;
    body.tetrahedra.push_back({copy.nodes, fill * std::clamp(copy.share, kLeastShare, 1.0)});
  }
  for (const TissuePlace& place : places) body.vertices.push_back({place.copy, place.weights});
}

// The skin gives way to tools as it did when it was whole, and so do walls, the less the deeper.
void CutOrgan::remake_give(const CutSkin& skin, std::span<const LipGape::Wall> down) {
  std::vector<std::vector<NodeShare>>& all = now_.mechanics.body->give_shares;
  all.clear();
  if (now_.mechanics.body->give_mm_per_n.empty()) return;
  all.resize(now_.proxy.vertices.size());
  for (const SkinPart& part : skin.parts()) {
    const FineSkin::Part& fine = fine_skin_.parts()[part.face];
    for (int k = 0; k < 3; ++k) {
      std::vector<NodeShare>& own = all[part.corners[k]];
      if (!own.empty()) continue;
      const Eigen::Vector2d at = within(fine.at, part.at[k]);
      const std::array<double, 3> weights = {1 - at.x() - at.y(), at.x(), at.y()};
      for (int corner = 0; corner < 3; ++corner)
        if (weights[corner] != 0)
          add_shares(carriers_[skin_.faces[fine.face][corner]], weights[corner], own);
    }
  }
  for (std::size_t w = 0; w < down.size(); ++w)
    add_shares(all[down[w].lip], 1 - down[w].down, all[skin.vertices().size() + w]);
}

Eigen::Vector3f CutOrgan::inner_albedo_of(const CutWalls& walls, std::size_t face, double b1,
                                          double b2) const {
  const std::array<double, 3> weights = {1 - b1 - b2, b1, b2};
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  double depth_mm = 0, share = 0;
  for (int k = 0; k < 3; ++k) {
    const CutWalls::Vertex& corner = walls.vertices[walls.faces[face][k]];
    at_mm += weights[k] * corner.at_mm, depth_mm += weights[k] * corner.depth_mm;
    share += weights[k] * corner.light;
  }
  return float(share) * inner_albedo(at_mm, depth_mm, mean_albedo_, alive());
}

std::vector<Eigen::Vector3d> CutOrgan::wall_normals(const TriangleMesh& cut,
                                                    std::uint32_t first_wall, std::uint32_t steps) {
  // By area, which slivers have little of, however they are twisted.
  std::vector<Eigen::Vector3d> of_vertices(cut.vertices.size(), Eigen::Vector3d::Zero()), normals;
  const std::span walls = std::span(cut.faces).subspan(first_wall);
  for (const auto& [a, b, c] : walls) {
    const Eigen::Vector3d& from = cut.vertices[a];
    const Eigen::Vector3d normal = (cut.vertices[b] - from).cross(cut.vertices[c] - from);
    for (const std::uint32_t v : {a, b, c}) of_vertices[v] += normal;
  }
  for (Eigen::Vector3d& normal : of_vertices) normal.stableNormalize();
  for (const Face& face : walls)
    each_node(steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t) {
      const double u = double(i) / steps, v = double(j) / steps;
      normals.push_back(
          ((1 - u - v) * of_vertices[face[0]] + u * of_vertices[face[1]] + v * of_vertices[face[2]])
              .stableNormalized());
    });
  return normals;
}

void CutOrgan::remake_base(const CutWalls& walls) {
  if (base_.face_count == 0) return;
  BaseLayer& base = now_.base;
  const std::uint32_t n = base.steps = base_.steps;
  const std::uint32_t nodes = base_.nodes_per_face();
  base.face_count = static_cast<std::uint32_t>(now_.proxy.faces.size());
  base.height_mm = base_.height_mm, base.color = base_.color, base.seen_by = base_.seen_by;
  const std::size_t all = std::size_t(base.face_count) * nodes;
  base.height_mm.resize(all, 0.0f), base.color.resize(all), base.seen_by.resize(all, 0);
  for (const auto& [face, parts] : face_parts_) {
    for (const FacePart& part : parts) {
      const std::size_t first = std::size_t(face) * nodes;
      each_mixed_node(n, part, [&](auto node, const LatticeMix& mix, const Eigen::Vector2d& b) {
        const std::size_t to = std::size_t(part.face) * nodes + node;
        base.height_mm[to] = 0, base.color[to].setZero(), base.seen_by[to] = ~0u;
        for (int k = 0; k < 3; ++k) {
          const std::size_t from = first + mix.nodes[k];
          base.height_mm[to] += mix.weights[k] * base_.height_mm[from];
          base.color[to] += mix.weights[k] * base_.color[from];
          if (mix.weights[k] > 0) base.seen_by[to] &= base_.seen_by[from];
        }
        base.height_mm[to] = part.limited(base.height_mm[to], b);
      });
    }
  }
  const auto first_wall = base.face_count - static_cast<std::uint32_t>(walls.faces.size());
  const std::vector<Eigen::Vector3d> normals = wall_normals(now_.proxy, first_wall, n);
  parallel_for(std::size_t{0}, walls.faces.size(), [&](std::size_t w) {
    each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
      Eigen::Vector3f& color = base.color[(first_wall + w) * nodes + node];
      color = inner_albedo_of(walls, w, double(i) / n, double(j) / n);
      if (lighting_)
        color.array() *=
            lighting_->diffuse(normals[w * nodes + node]).cwiseMax(0.05).cast<float>().array();
    });
  });
}

}  // namespace organbake
