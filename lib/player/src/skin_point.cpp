// SPDX-License-Identifier: Apache-2.0
// Where a line from an organ's centre meets its skin at rest: the farthest crossing with the
// triangles of the base layer's lattice. From it follow the places of pokes and the thickness
// there. A place whose dent a view shows is the cheapest of the vertices that it sees, by how they
// lie to it and what lies round about.
#include "organbake/player/skin_point.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/shell.h"
#include "trocar.h"

namespace organbake {
namespace {

struct Crossing {
  // From the organ's centre along the line; negative where all skin lies behind, as that of an open
  // surface that is hollow may.
  double distance_mm;
  bool leaves;  // the line goes out of the skin there, not in
};

// The skin at rest of a bundle that is sound, for lines from the organ's centre.
class SkinAtRest {
 public:
  explicit SkinAtRest(const Bundle& bundle)
      : base_(bundle.base),
        center_(bundle.cameras.manifold.center_world_mm),
        shell_(bundle.skin ? smooth_skin_mesh(bundle.proxy, *bundle.skin) : bundle.proxy) {
    for (const float height_mm : base_.height_mm)
      highest_mm_ = std::max(highest_mm_, std::abs(double(height_mm)));
  }
  // Where a line along a unit direction crosses it farthest.
  std::optional<Crossing> farthest_crossing(const Eigen::Vector3d& d) const;

 private:
  // Whether a face's skin is so near to the line that it may cross it.
  bool beside(std::uint32_t face, const Eigen::Vector3d& d) const {
    const Eigen::Vector3d& corner = shell_.vertices[shell_.faces[face][0]];
    double reach_mm = highest_mm_;  // of the face from a corner of its
    for (const std::uint32_t v : shell_.faces[face])
      reach_mm = std::max(reach_mm, highest_mm_ + (shell_.vertices[v] - corner).norm());
    return d.cross(corner - center_).norm() <= (1 + 1e-6) * reach_mm;
  }
  // All faces at the corners of some.
  TriangleMesh around(const std::vector<std::uint32_t>& faces) const {
    std::vector<bool> corner(shell_.vertices.size());
    for (const std::uint32_t f : faces)
      for (const std::uint32_t v : shell_.faces[f]) corner[v] = true;
    TriangleMesh near{shell_.vertices, {}, {}};
    std::copy_if(shell_.faces.begin(), shell_.faces.end(), std::back_inserter(near.faces),
                 [&](const Face& f) { return corner[f[0]] || corner[f[1]] || corner[f[2]]; });
    return near;
  }

  const BaseLayer& base_;
  const Eigen::Vector3d center_;
  const TriangleMesh shell_;
  double highest_mm_ = 0;
};

std::optional<Crossing> SkinAtRest::farthest_crossing(const Eigen::Vector3d& d) const {
  const std::uint32_t n = base_.steps;
  const double extent_mm = bounds(shell_).diagonal();
  std::optional<Crossing> farthest;
  const auto meet = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c) {
    const std::optional<double> distance = line_crossing(center_, d, a, b, c);
    // What lies farther behind is beside the organ, not in its hollow.
    if (!distance || *distance < -extent_mm) return;
    if (!farthest || *distance > farthest->distance_mm)
      farthest = {*distance, (b - a).cross(c - a).dot(d) > 0};
  };
  std::vector<std::uint32_t> faces;
  for (std::uint32_t f = 0; f < base_.face_count; ++f)
    if (beside(f, d)) faces.push_back(f);
  const std::vector<Eigen::Vector3d> normals = vertex_normals(around(faces));
  for (const std::uint32_t f : faces) {
    const ShellMatrix m = shell_matrix(shell_, normals, f);
    const float* heights = &base_.height_mm[std::size_t(f) * base_.nodes_per_face()];
    const auto node = [&](std::uint32_t i, std::uint32_t j) {
      return shell_point(m, double(i) / n, double(j) / n, heights[base_node_index(n, i, j)]);
    };
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = 0; i + j < n; ++j) {
        const Eigen::Vector3d b = node(i + 1, j), c = node(i, j + 1);
        meet(node(i, j), b, c);
        if (i + j + 1 < n) meet(b, node(i + 1, j + 1), c);
      }
    }
  }
  return farthest;
}

}  // namespace

SkinPlace skin_place(const Bundle& bundle, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d d = direction.normalized();
  const std::optional<Crossing> skin = SkinAtRest(bundle).farthest_crossing(d);
  if (!skin) {
    throw BadDataError("no skin lies in the direction (" + to_text(d.x(), 3) + ", " +
                       to_text(d.y(), 3) + ", " + to_text(d.z(), 3) + ") from the organ's centre");
  }
  // Only an open sheet can be met from behind; a closed skin's folds may look as if it was.
  const bool from_behind = !skin->leaves && analyse_topology(bundle.proxy).boundary_edges > 0;
  return {bundle.cameras.manifold.center_world_mm + skin->distance_mm * d, from_behind};
}

Eigen::Vector3d poke_direction(const Bundle& bundle) {
  const SkinAtRest skin(bundle);
  for (const Eigen::Vector3d& d : bundle.cameras.manifold.directions)
    if (skin.farthest_crossing(d.normalized())) return d;
  throw BadDataError("no camera looks at skin over the organ's centre");
}

double thickness_mm(const Bundle& bundle, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d skin = skin_place(bundle, direction).skin_mm, d = direction.normalized();
  constexpr double kShareOfExtent = 0.25;
  const std::optional<Crossing> behind = SkinAtRest(bundle).farthest_crossing(-d);
  const bool hollow = d.dot(skin - bundle.cameras.manifold.center_world_mm) < 0;
  if (hollow || !behind || behind->distance_mm < 0)
    return kShareOfExtent * bounds(bundle.proxy).diagonal();
  return (skin - bundle.cameras.manifold.center_world_mm).norm() + behind->distance_mm;
}

namespace {

using Eigen::Vector2d, Eigen::Vector3d;

// What a view makes of places to press.
class SiteChoice {
 public:
  SiteChoice(const Bundle& bundle, const View& view, double radius_mm)
      : skin_(bundle.shell().at_rest()),
        normals_(vertex_normals(skin_)),
        camera_(view.camera),
        eye_(view.camera.center_world_mm()),
        near_mm_(kNear * radius_mm),
        edge_mm_(mean_edge_mm(bundle.proxy)) {
    for (const std::uint32_t a : bundle.mechanics.anchors)
      anchors_.push_back(bundle.proxy.vertices[a]);
    if (const auto& body = bundle.mechanics.body)
      for (const std::uint32_t a : body->anchors) anchors_.push_back(body->nodes_mm[a]);
    MeshEdges(bundle.proxy).for_each([&](std::span<const EdgeUse> uses) {
      for (const std::uint32_t v : {uses[0].low, uses[0].high})
        if (uses.size() == 1) anchors_.push_back(bundle.proxy.vertices[v]);
    });
  }

  const TriangleMesh& skin() const { return skin_; }
  // Lower is better; nothing where the view does not see it.
  std::optional<double> price(std::uint32_t vertex) const {
    const Vector3d& at = skin_.vertices[vertex];
    const Vector3d in_camera = camera_.camera_from_world * at;
    if (!(in_camera.z() > 0)) return std::nullopt;
    const Intrinsics& lens = camera_.intrinsics;
    const double half = 0.5 * std::min(lens.width, lens.height);
    const Vector2d off = (project(lens, in_camera) - Vector2d(lens.cx, lens.cy)) / half;
    if (off.cwiseAbs().maxCoeff() > 1) return std::nullopt;
    const Around around = look_around(vertex);
    const double tilt =
        std::acos(std::clamp(around.outward.dot((eye_ - at).normalized()), -1., 1.));
    if (tilt > kSteepest_rad) return std::nullopt;
    return squared((tilt - kAside_rad) / 0.25) + squared(off.norm() / 0.5) +
           6 * around.rises / near_mm_ + 12 * around.bends + 40 * anchored(at);
  }
  Vector3d outward(std::uint32_t vertex) const { return look_around(vertex).outward; }
  // Whether nothing lies before it; nor before a tool that comes along its normal.
  bool is_open(std::uint32_t vertex) const {
    const Vector3d& at = skin_.vertices[vertex];
    const Vector3d out = outward(vertex);
    return !meets(at, eye_ - at, near_mm_ / (eye_ - at).norm(), 1) &&
           !meets(at, out, near_mm_, bounds(skin_).diagonal());
  }
  // Along a line into the organ; the far side.
  std::optional<double> behind_mm(const Vector3d& at, const Vector3d& inward) const {
    std::optional<double> least;
    const double beyond = 0.2 * near_mm_;
    each_crossing(at, inward, [&](double t) {
      if (t > beyond && (!least || t < *least)) least = t;
    });
    return least;
  }

 private:
  static constexpr double kNear = 2.5;       // tip radii: as far as a dent reaches about
  static constexpr double kAside_rad = 0.6;  // of the view, so that it sees how deep a dent is
  static constexpr double kSteepest_rad = 1.1;
  static double mean_edge_mm(const TriangleMesh& mesh) {
    double sum = 0;
    for (const auto& [a, b, c] : mesh.faces) sum += (mesh.vertices[b] - mesh.vertices[a]).norm();
    return sum / double(mesh.faces.size());
  }
  static double squared(double x) { return x * x; }

  // How the skin lies within reach of a dent: its mean normal, how high it rises over the place,
  // and how far normals turn.
  struct Around {
    Vector3d outward = Vector3d::Zero();
    double rises = 0, bends = 0;
  };
  Around look_around(std::uint32_t vertex) const {
    Around around;
    const Vector3d &at = skin_.vertices[vertex], &normal = normals_[vertex];
    double count = 0;
    for (std::size_t v = 0; v < skin_.vertices.size(); ++v) {
      const Vector3d way = skin_.vertices[v] - at;
      if (way.squaredNorm() > near_mm_ * near_mm_ || normals_[v].dot(normal) < -0.5) continue;
      around.outward += normals_[v];
      around.rises = std::max(around.rises, way.dot(normal));
      around.bends += 1 - normals_[v].dot(normal);
      ++count;
    }
    around.bends /= count;
    around.outward.normalize();
    return around;
  }
  // Of what does not give way: 1 beside it, 0 beyond two dents and an edge of what carries skin.
  double anchored(const Vector3d& at) const {
    const double reach_mm = 2 * near_mm_ + edge_mm_;
    double nearest_mm = reach_mm;
    for (const Vector3d& anchor : anchors_) nearest_mm = std::min(nearest_mm, (anchor - at).norm());
    return 1 - nearest_mm / reach_mm;
  }
  template <class Use>
  void each_crossing(const Vector3d& from, const Vector3d& along, const Use& use) const {
    for (const auto& [a, b, c] : skin_.faces)
      if (const auto t =
              line_crossing(from, along, skin_.vertices[a], skin_.vertices[b], skin_.vertices[c]))
        use(*t);
  }
  bool meets(const Vector3d& from, const Vector3d& along, double least, double most) const {
    bool met = false;
    each_crossing(from, along, [&](double t) { met = met || (t > least && t < most); });
    return met;
  }

  const TriangleMesh skin_;
  const std::vector<Vector3d> normals_;
  const PosedCamera& camera_;
  const Vector3d eye_;
  const double near_mm_, edge_mm_;
  std::vector<Vector3d> anchors_;  // and the border of an open sheet, which would bend away
};

}  // namespace

PokeSite poke_site(const Bundle& bundle, const View& view, double radius_mm) {
  constexpr std::size_t kTried = 1500;
  const SiteChoice choice(bundle, view, radius_mm);
  const std::vector<Eigen::Vector3d>& vertices = choice.skin().vertices;
  std::vector<std::pair<double, std::uint32_t>> sites;
  for (std::size_t v = 0; v < vertices.size(); v += 1 + vertices.size() / kTried)
    if (const auto price = choice.price(static_cast<std::uint32_t>(v)))
      sites.emplace_back(*price, static_cast<std::uint32_t>(v));
  if (sites.empty()) {  // too few vertices, or none that faces the view
    const Eigen::Vector3d outward = poke_direction(bundle).normalized();
    return {skin_place(bundle, outward).skin_mm, outward, thickness_mm(bundle, outward)};
  }
  std::sort(sites.begin(), sites.end());
  const auto open = std::find_if(sites.begin(), sites.end(),
                                 [&](const auto& site) { return choice.is_open(site.second); });
  const std::uint32_t best = (open == sites.end() ? sites.begin() : open)->second;
  PokeSite site{vertices[best], choice.outward(best), 0};
  constexpr double kShareOfExtent = 0.25;
  const double sheet_mm = kShareOfExtent * bounds(choice.skin()).diagonal();
  site.thickness_mm =
      std::min(choice.behind_mm(site.skin_mm, -site.outward).value_or(sheet_mm), 2 * sheet_mm);
  return site;
}

}  // namespace organbake
