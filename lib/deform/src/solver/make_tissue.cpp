// SPDX-License-Identifier: Apache-2.0
// Checks what bundles tell of a body, and makes the tissue that stands for it: in, the bodies as
// they were baked or cut; out, springs or finite elements, or an error that names what is wrong.
#include "solver/make_tissue.h"

#include <cmath>
#include <string>

#include "body/fem_body.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "solver/spring_network.h"

namespace organbake::deform {
namespace {

// The message is written when it is needed: there are more checks than anything else to do here.
template <class Message>
void require(bool holds, const Message& message) {
  if (!holds) throw BadDataError(message());
}

template <class What>
void require_positive(double value, const What& what) {
  // The test is written so that NaN fails it.
  require(value > 0 && std::isfinite(value),
          [&] { return what() + (" is " + to_text(value) + "; it must be > 0"); });
}

void check_spring(const Spring& s, std::size_t index, std::size_t vertices) {
  const auto name = [&] { return "spring " + std::to_string(index); };
  require(s.a < vertices && s.b < vertices && s.a != s.b, [&] {
    return name() + " joins vertices " + std::to_string(s.a) + " and " + std::to_string(s.b) +
           "; they must be two of the proxy's " + std::to_string(vertices);
  });
  require_positive(s.rest_length_mm, [&] { return name() + ": rest length (mm)"; });
  require_positive(s.stiffness_n_per_mm, [&] { return name() + ": stiffness (N/mm)"; });
  require(s.damping_n_s_per_mm >= 0 && std::isfinite(s.damping_n_s_per_mm), [&] {
    return name() + ": damping (N s/mm) is " + to_text(s.damping_n_s_per_mm) + "; it must be >= 0";
  });
}

void check_proxy(const TriangleMesh& proxy) {
  require(!proxy.vertices.empty(),
          [&] { return std::string("the proxy has no vertices to deform"); });
  for (std::size_t v = 0; v < proxy.vertices.size(); ++v) {
    require(proxy.vertices[v].allFinite(),
            [&] { return "proxy vertex " + std::to_string(v) + " is not finite"; });
  }
  for (std::size_t f = 0; f < proxy.faces.size(); ++f) {
    for (const std::uint32_t v : proxy.faces[f]) {
      require(v < proxy.vertices.size(), [&] {
        return "proxy face " + std::to_string(f) + " names vertex " + std::to_string(v) + " of " +
               std::to_string(proxy.vertices.size());
      });
    }
  }
}

void check_tetrahedron(const TetrahedralBody& body, std::size_t index) {
  const Tetrahedron& t = body.tetrahedra[index];
  const auto name = [&] { return "tetrahedron " + std::to_string(index); };
  for (const std::uint32_t n : t.nodes) {
    require(n < body.nodes_mm.size(), [&] {
      return name() + " names node " + std::to_string(n) + " of " +
             std::to_string(body.nodes_mm.size());
    });
  }
  require_positive(volume_of(body, t), [&] { return name() + ": volume (mm³)"; });
  require(t.fill > 0 && t.fill <= 1,
          [&] { return name() + ": fill is " + to_text(t.fill) + "; it must be 0 to 1"; });
}

// Skin of a cut body may stand out of the tetrahedron that carries it.
constexpr double kOutside = 2;

void check_embedded(const TetrahedralBody& body, std::size_t vertex) {
  const EmbeddedVertex& v = body.vertices[vertex];
  const auto name = [&] { return "embedded vertex " + std::to_string(vertex); };
  require(v.tetrahedron < body.tetrahedra.size(), [&] {
    return name() + " lies in tetrahedron " + std::to_string(v.tetrahedron) + " of " +
           std::to_string(body.tetrahedra.size());
  });
  for (const double w : v.weights) {
    require(w >= -kOutside && w <= 1 + kOutside,
            [&] { return name() + " has a weight of " + to_text(w) + "; it must be 0 to 1"; });
  }
}

void check_patch(const TetrahedralBody& body, std::size_t vertex) {
  for (const auto& [node, weight] : body.patches[vertex]) {
    require(node < body.nodes_mm.size() && std::abs(weight) <= 1 + kOutside, [&, n = node,
                                                                              w = weight] {
      return "the patch of vertex " + std::to_string(vertex) + " gives node " + std::to_string(n) +
             " of " + std::to_string(body.nodes_mm.size()) + " a weight of " + to_text(w);
    });
  }
}

void check_give(const TetrahedralBody& body) {
  const std::size_t places = body.give_mm_per_n.size();
  for (std::size_t p = 0; p < places; ++p) {
    const double give = body.give_mm_per_n[p];
    require(give >= 0 && std::isfinite(give), [&] {
      return "vertex " + std::to_string(p) + " gives way by " + to_text(give) +
             " mm per N; it must be >= 0";
    });
  }
  const bool own = body.give_shares.empty();
  require(places == 0 || (own ? places : body.give_shares.size()) == body.vertices.size(), [&] {
    return "the skin gives way at " + std::to_string(own ? places : body.give_shares.size()) +
           " of the proxy's " + std::to_string(body.vertices.size()) + " vertices";
  });
  for (const auto& shares : body.give_shares)
    for (const NodeShare& share : shares)
      require(share.node < places && std::isfinite(share.weight), [&] {
        return "the skin follows what vertex " + std::to_string(share.node) + " of " +
               std::to_string(places) + " gives way by a share of " + to_text(share.weight);
      });
}

// Each vertex that is no anchor once, or nothing.
void check_order(const MechanicsModel& mechanics) {
  if (mechanics.elimination_order.empty()) return;
  std::vector<int> times(mechanics.mass_kg.size(), 0);
  for (const std::uint32_t anchor : mechanics.anchors) times[anchor] = 1;
  for (const std::uint32_t v : mechanics.elimination_order) {
    require(v < times.size(), [&] {
      return "the elimination order names vertex " + std::to_string(v) + " of " +
             std::to_string(times.size());
    });
    ++times[v];
  }
  for (std::size_t v = 0; v < times.size(); ++v) {
    require(times[v] == 1, [&] {
      return "the elimination order and the anchors name vertex " + std::to_string(v) + " " +
             std::to_string(times[v]) + " times; it must be once";
    });
  }
}

}  // namespace

void check_tetrahedra(const TriangleMesh& proxy, const MechanicsModel& mechanics) {
  check_proxy(proxy);
  const TetrahedralBody& body = *mechanics.body;
  for (std::size_t n = 0; n < body.nodes_mm.size(); ++n) {
    require(body.nodes_mm[n].allFinite(),
            [&] { return "node " + std::to_string(n) + " is not finite"; });
  }
  for (std::size_t t = 0; t < body.tetrahedra.size(); ++t) check_tetrahedron(body, t);
  require(body.vertices.size() == proxy.vertices.size(), [&] {
    return "the tetrahedra carry " + std::to_string(body.vertices.size()) +
           " vertices of a proxy of " + std::to_string(proxy.vertices.size());
  });
  for (std::size_t v = 0; v < body.vertices.size(); ++v) check_embedded(body, v);
  require(body.patches.empty() || body.patches.size() == proxy.vertices.size(), [&] {
    return "the tetrahedra have patches for " + std::to_string(body.patches.size()) +
           " vertices of a proxy of " + std::to_string(proxy.vertices.size());
  });
  for (std::size_t v = 0; v < body.patches.size(); ++v) check_patch(body, v);
  check_give(body);
  for (const std::uint32_t anchor : body.anchors) {
    require(anchor < body.nodes_mm.size(), [&] {
      return "anchored node " + std::to_string(anchor) + " is none of " +
             std::to_string(body.nodes_mm.size());
    });
  }
  require(body.poisson_ratio >= 0 && body.poisson_ratio <= 0.49, [&] {
    return "Poisson's ratio is " + to_text(body.poisson_ratio) + "; it must be 0 to 0.49";
  });
  require(body.damping_s >= 0 && std::isfinite(body.damping_s),
          [&] { return "the damping (s) is " + to_text(body.damping_s) + "; it must be >= 0"; });
  require_positive(mechanics.young_modulus_kpa,
                   [&] { return std::string("Young's modulus (kPa)"); });
  require_positive(mechanics.density_kg_per_m3, [&] { return std::string("the density (kg/m³)"); });
}

void check_mechanics(const TriangleMesh& proxy, const MechanicsModel& mechanics) {
  check_proxy(proxy);
  const std::size_t vertices = proxy.vertices.size();
  require(mechanics.mass_kg.size() == vertices, [&] {
    return "the mechanics have " + std::to_string(mechanics.mass_kg.size()) +
           " masses for a proxy of " + std::to_string(vertices) + " vertices";
  });
  for (std::size_t v = 0; v < vertices; ++v) {
    require_positive(mechanics.mass_kg[v],
                     [&] { return "the mass (kg) of vertex " + std::to_string(v); });
  }
  for (std::size_t s = 0; s < mechanics.springs.size(); ++s) {
    check_spring(mechanics.springs[s], s, vertices);
  }
  for (const std::uint32_t anchor : mechanics.anchors) {
    require(anchor < vertices, [&] {
      return "anchor " + std::to_string(anchor) + " is no vertex of the proxy's " +
             std::to_string(vertices);
    });
  }
  check_order(mechanics);
  require(mechanics.volume_stiffness >= 0 && mechanics.volume_stiffness <= 1, [&] {
    return "volume stiffness is " + to_text(mechanics.volume_stiffness) + "; it must be 0 to 1";
  });
}

void check_base_fits(const TriangleMesh& proxy, const BaseLayer& base) {
  if (base.face_count == 0 && base.height_mm.empty()) return;
  require(base.face_count == proxy.faces.size(), [&] {
    return "the base layer has " + std::to_string(base.face_count) + " faces, the proxy " +
           std::to_string(proxy.faces.size());
  });
  require(base.steps >= 1, [&] { return std::string("the base layer has no steps"); });
  require(base.height_mm.size() == std::size_t{base.face_count} * base.nodes_per_face(), [&] {
    return "the base layer has " + std::to_string(base.height_mm.size()) + " heights for " +
           std::to_string(base.face_count) + " faces of " + std::to_string(base.nodes_per_face()) +
           " nodes";
  });
  for (std::size_t i = 0; i < base.height_mm.size(); ++i) {
    require(std::isfinite(base.height_mm[i]), [&] {
      return "base layer node " + std::to_string(i) + " has a height that is not finite";
    });
  }
}

std::unique_ptr<const Tissue> make_tissue(const DeformBodies& bodies,
                                          const DeformOptions& options) {
  if (options.solver == TissueSolver::fem) {
    return std::make_unique<FemBody>(bodies, options.time_step_s);
  }
  return std::make_unique<SpringNetwork>(bodies, options.time_step_s);
}

std::vector<double> kept_volumes(const DeformBodies& bodies, const DeformOptions& options) {
  std::vector<double> kept;
  for (const DeformBody& body : bodies) {
    kept.push_back(options.solver == TissueSolver::fem ? 0 : body.mechanics.volume_stiffness);
  }
  return kept;
}

const DeformBodies& checked_skins(const DeformBodies& bodies) {
  for (const DeformBody& body : bodies) {
    if (body.skin) {
      check_smooth_skin(*body.skin, body.proxy, "smooth skin");
    } else {
      check_base_fits(body.proxy, body.base);
    }
  }
  return bodies;
}

}  // namespace organbake::deform
