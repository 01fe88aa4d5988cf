// SPDX-License-Identifier: Apache-2.0
#include "deform/mechanics_checks.h"

#include <cmath>
#include <string>

#include "core/error.h"
#include "core/text.h"

namespace organbake::deform {
namespace {

void require(bool holds, const std::string& message) {
  if (!holds) throw BadDataError(message);
}

void require_positive(double value, const std::string& what) {
  // The test is written so that NaN fails it.
  require(value > 0 && std::isfinite(value), what + " is " + to_text(value) + "; it must be > 0");
}

void check_spring(const Spring& s, std::size_t index, std::size_t vertices) {
  const std::string name = "spring " + std::to_string(index);
  require(s.a < vertices && s.b < vertices && s.a != s.b,
          name + " joins vertices " + std::to_string(s.a) + " and " + std::to_string(s.b) +
              "; they must be two of the proxy's " + std::to_string(vertices));
  require_positive(s.rest_length_mm, name + ": rest length (mm)");
  require_positive(s.stiffness_n_per_mm, name + ": stiffness (N/mm)");
  require(s.damping_n_s_per_mm >= 0 && std::isfinite(s.damping_n_s_per_mm),
          name + ": damping (N s/mm) is " + to_text(s.damping_n_s_per_mm) + "; it must be >= 0");
}

void check_proxy(const TriangleMesh& proxy) {
  require(!proxy.vertices.empty(), "the proxy has no vertices to deform");
  for (std::size_t v = 0; v < proxy.vertices.size(); ++v) {
    require(proxy.vertices[v].allFinite(), "proxy vertex " + std::to_string(v) + " is not finite");
  }
  for (std::size_t f = 0; f < proxy.faces.size(); ++f) {
    for (const std::uint32_t v : proxy.faces[f]) {
      require(v < proxy.vertices.size(), "proxy face " + std::to_string(f) + " names vertex " +
                                             std::to_string(v) + " of " +
                                             std::to_string(proxy.vertices.size()));
    }
  }
}

}  // namespace

void check_mechanics(const TriangleMesh& proxy, const MechanicsModel& mechanics) {
  check_proxy(proxy);
  const std::size_t vertices = proxy.vertices.size();
  require(mechanics.mass_kg.size() == vertices,
          "the mechanics have " + std::to_string(mechanics.mass_kg.size()) +
              " masses for a proxy of " + std::to_string(vertices) + " vertices");
  for (std::size_t v = 0; v < vertices; ++v) {
    require_positive(mechanics.mass_kg[v], "the mass (kg) of vertex " + std::to_string(v));
  }
  for (std::size_t s = 0; s < mechanics.springs.size(); ++s) {
    check_spring(mechanics.springs[s], s, vertices);
  }
  for (const std::uint32_t anchor : mechanics.anchors) {
    require(anchor < vertices, "anchor " + std::to_string(anchor) +
                                   " is no vertex of the proxy's " + std::to_string(vertices));
  }
  require(mechanics.volume_stiffness >= 0 && mechanics.volume_stiffness <= 1,
          "volume stiffness is " + to_text(mechanics.volume_stiffness) + "; it must be 0 to 1");
}

void check_base_fits(const TriangleMesh& proxy, const BaseLayer& base) {
  if (base.face_count == 0 && base.height_mm.empty()) return;
  require(base.face_count == proxy.faces.size(),
          "the base layer has " + std::to_string(base.face_count) + " faces, the proxy " +
              std::to_string(proxy.faces.size()));
  require(base.steps >= 1, "the base layer has no steps");
  require(base.height_mm.size() == std::size_t{base.face_count} * base.nodes_per_face(),
          "the base layer has " + std::to_string(base.height_mm.size()) + " heights for " +
              std::to_string(base.face_count) + " faces of " +
              std::to_string(base.nodes_per_face()) + " nodes");
  for (std::size_t i = 0; i < base.height_mm.size(); ++i) {
    require(std::isfinite(base.height_mm[i]),
            "base layer node " + std::to_string(i) + " has a height that is not finite");
  }
}

}  // namespace organbake::deform
