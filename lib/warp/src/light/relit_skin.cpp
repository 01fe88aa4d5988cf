// SPDX-License-Identifier: Apache-2.0
// Lights the skin as it lies now, at the nodes of the base layer's lattice: by the world's light,
// or from the scope. A face in view is lit anew only when its normals have turned since, or the
// light has changed.
#include "light/relit_skin.h"

#include <algorithm>
#include <utility>

#include "organbake/core/parallel.h"
#include "organbake/geometry/smooth_skin.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr std::uint32_t kFaceGrain = 32;

// By node, the most that the lattice's normals turn along an edge that meets it there, rad a mm: a
// crease narrower than the lattice's steps. Faces have one number where they meet, or light would
// end there in steps.
std::vector<float> bends_of(const BaseLayer& lattice, const TriangleMesh& surface,
                            const std::vector<ShellMatrix>& rest,
                            const std::vector<Vector3f>& normals) {
  const std::uint32_t n = lattice.steps;
  std::vector<float> bends(normals.size(), 0);
  parallel_each(0u, lattice.face_count, kFaceGrain, [&](std::uint32_t f) {
    const std::size_t first = std::size_t(f) * lattice.nodes_per_face();
    std::vector<Vector3f> places(lattice.nodes_per_face());
    each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
      places[node] =
          shell_point(rest[f], double(i) / n, double(j) / n, lattice.height_mm[first + node])
              .cast<float>();
    });
    const auto bend = [&](std::uint32_t a, std::uint32_t b) {
      const float turn = (normals[first + a] - normals[first + b]).norm() /
                         std::max((places[a] - places[b]).norm(), WetFilm::kBridges_mm);
      for (const std::uint32_t node : {a, b})
        bends[first + node] = std::max(bends[first + node], turn);
    };
    each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
      if (i + j == n) return;
      const std::uint32_t down = base_node_index(n, i + 1, j), right = base_node_index(n, i, j + 1);
      bend(node, down), bend(node, right), bend(down, right);
    });
  });
  const Lattice nodes(surface, n);
  std::vector<float> joined(nodes.node_count(), 0);
  for (const bool give : {false, true})
    for (std::uint32_t f = 0; f < lattice.face_count; ++f)
      each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
        float& own = bends[std::size_t(f) * lattice.nodes_per_face() + node];
        float& most = joined[nodes.node(f, i, j)];
        (give ? own : most) = std::max(own, most);
      });
  return bends;
}

}  // namespace

RelitSkin::RelitSkin(const BaseLayer& layer, const ShellSurface& shell, const Lighting& lighting,
                     const std::vector<Vector3d>& rest_normals)
    : lattice_{layer.steps, layer.face_count, layer.height_mm, {}, {}},
      lighting_(lighting),
      gloss_(lighting),
      shine_(lighting),
      turns_(shell),
      revisions_(layer.face_count, 0),
      turned_(layer.face_count, 0),
      shines_(layer.face_count, 0),
      to_place_(layer.face_count, 1),
      to_light_(layer.face_count, 1) {
  for (const Vector3d& normal : rest_normals) {
    rest_normals_.push_back(normal.cast<float>());
    // Of the very number that light_face() asks for at rest: to the bit, nothing is lit anew there.
    rest_light_.push_back(light_on(rest_normals_.back().cast<double>()));
  }
  places_.resize(rest_normals_.size());
  nodes_.resize(rest_normals_.size());
  if (lighting.finish.relief_slope > 0)
    bends_ = bends_of(lattice_, shell.at_rest(), turns_.rest(), rest_normals_);
}

std::vector<std::uint8_t> RelitSkin::turn(const PosedShell& shell) {
  std::vector<std::uint8_t> changed(revisions_.size()), turned(revisions_.size());
  for (std::size_t f = 0; f < changed.size(); ++f) {
    changed[f] = revisions_[f] != shell.revisions()[f];
    to_place_[f] |= changed[f];
  }
  revisions_ = shell.revisions();
  turns_.place(shell.matrices(), changed, turned);
  for (std::size_t f = 0; f < turned.size(); ++f) to_light_[f] |= turned[f];
  return turned;
}

// What the light at the scope asks for at rest alone: what film and grain are bound to, and the
// albedo.
void RelitSkin::place_rest_nodes() {
  const std::uint32_t n = lattice_.steps;
  parallel_for(std::uint32_t{0}, lattice_.face_count, [&](std::uint32_t f) {
    each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
      const std::size_t at = first_node(f) + node;
      const Vector3d place =
          shell_point(turns_.rest()[f], double(i) / n, double(j) / n, lattice_.height_mm[at]);
      nodes_[at].rest_normal.head<3>() = rest_normals_[at];
      nodes_[at].rest_normal[3] = bends_.empty() ? 0 : bends_[at];
      nodes_[at].rest_mm.head<3>() = place.cast<float>();
      nodes_[at].gain.head<3>() = rest_light_[at].cwiseInverse().cwiseMin(kLargestGain);
    });
  });
}

void RelitSkin::light_faces(const View& view, DrawnLight light, double reference_mm,
                            const PosedShell& shell, const std::vector<std::uint8_t>& shown) {
  const bool scope = light == DrawnLight::scope;
  if (scope != from_scope_) {  // every face has to be lit anew
    from_scope_ = scope;
    std::fill(to_light_.begin(), to_light_.end(), std::uint8_t{1});
    if (scope) place_rest_nodes();
  }
  shine_.look(view, reference_mm);
  const Vector3f eye = view.camera.center_world_mm().cast<float>();
  parallel_each(0u, lattice_.face_count, kFaceGrain, [&](std::uint32_t f) {
    if (!shown[f]) return;
    if (std::exchange(to_light_[f], 0)) light_face(f);
    if (scope || gloss_.none()) return;
    const std::uint32_t n = lattice_.steps;
    if (std::exchange(to_place_[f], 0))
      each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
        const std::size_t at = first_node(f) + node;
        places_[at] =
            shell_point(shell.matrices()[f], double(i) / n, double(j) / n, lattice_.height_mm[at])
                .cast<float>();
      });
    shines_[f] = may_shine(f, eye);
  });
}

Vector3f RelitSkin::light_on(const Vector3d& normal) const {
  return lighting_.diffuse(normal).cast<float>().cwiseMax(kLeastLight);
}

void RelitSkin::light_face(std::uint32_t face) {
  const std::uint32_t n = lattice_.steps;
  const float step = 1 / static_cast<float>(n);
  const bool at_rest = turns_.at_rest(face);
  const NormalTransport::OnFace turns = turns_.on(face);
  const bool breaks = lighting_.finish.relief_slope > WetFilm::kBreaks;
  turned_[face] = from_scope_;
  each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
    const std::size_t at = first_node(face) + node;
    Vector3f normal = rest_normals_[at];
    float more_bent = 0;
    if (!at_rest) {
      const NormalTransport::Turn turn =
          turns_.at(turns, step * static_cast<float>(i), step * static_cast<float>(j));
      normal = unit_vector((turn * normal).eval().head<3>());
      if (!breaks) more_bent = positive(turn(3, 0));  // drops lie as at rest
    }
    nodes_[at].normal << normal, more_bent;
    if (from_scope_) return;
    const Vector3f gain = light_on(normal.cast<double>()).cwiseQuotient(rest_light_[at]);
    nodes_[at].gain.head<3>() = gain.cwiseMin(kLargestGain);
    turned_[face] |= nodes_[at].gain.head<3>() != Vector3f::Ones();
  });
}

// Where a view can see gloss: on faces with a node whose normal is near enough to half-way.
bool RelitSkin::may_shine(std::uint32_t face, const Vector3f& eye) const {
  const std::size_t first = first_node(face);
  for (std::size_t at = first; at < first + lattice_.nodes_per_face(); ++at) {
    if (gloss_.may_show(nodes_[at].normal.head<3>(), unit_vector(eye - places_[at]))) return true;
  }
  return false;
}

}  // namespace organbake
