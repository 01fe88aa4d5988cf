// SPDX-License-Identifier: Apache-2.0
// Takes the positions of vertices or nodes from another program's memory into an organ's state,
// after a check of their count, their values and whether they can be this organ's.
#include "organbake/player/state_reader.h"

#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "inside_of_skin.h"
#include "organbake/core/error.h"
#include "plausible_places.h"

namespace organbake {
namespace {

std::vector<std::array<std::uint32_t, 4>> corners_of(const TetrahedralBody& body) {
  std::vector<std::array<std::uint32_t, 4>> corners;
  for (const Tetrahedron& t : body.tetrahedra) corners.push_back(t.nodes);
  return corners;
}

template <class Number>
void copy_places(std::span<const Number> xyz_mm, const std::string& what, std::size_t count,
                 std::vector<Eigen::Vector3d>& places) {
  if (xyz_mm.size() != 3 * count) {
    throw UsageError(std::to_string(xyz_mm.size() / 3) + " " + what + " for an organ of " +
                     std::to_string(count));
  }
  places.resize(count);
  double sum = 0;  // of zeros, or not a number
  for (std::size_t i = 0; i < count; ++i) {
    places[i] = Eigen::Vector3d(xyz_mm[3 * i], xyz_mm[3 * i + 1], xyz_mm[3 * i + 2]);
    sum += 0 * (places[i].x() + places[i].y() + places[i].z());
  }
  for (std::size_t i = 0; sum != 0 && i < xyz_mm.size(); ++i) {
    if (!std::isfinite(xyz_mm[i]))
      throw UsageError("of the " + what + ", number " + std::to_string(i / 3) + " is not finite");
  }
}

}  // namespace

struct StateReader::Impl {
  const Bundle& organ;
  PlausiblePlaces vertices;
  std::optional<PlausiblePlaces> nodes;

  explicit Impl(const Bundle& given)
      : organ(given), vertices("vertices", given.proxy.vertices, given.proxy.faces) {
    if (!organ.mechanics.body) return;
    nodes.emplace("nodes", organ.mechanics.body->nodes_mm, corners_of(*organ.mechanics.body));
  }
};

StateReader::StateReader(const Bundle& organ) : impl_(std::make_unique<const Impl>(organ)) {}
StateReader::~StateReader() = default;

std::size_t StateReader::count(StateOf of) const {
  const auto& body = impl_->organ.mechanics.body;
  if (of == StateOf::vertices) return impl_->organ.proxy.vertices.size();
  return body ? body->nodes_mm.size() : 0;
}

template <class Number>
void StateReader::read_numbers(std::span<const Number> xyz_mm, StateOf of,
                               OrganState& state) const {
  const auto& [organ, vertices, nodes] = *impl_;
  if (of == StateOf::vertices) {
    copy_places(xyz_mm, "vertices", count(of), state.vertices_mm);
    return vertices.check(state.vertices_mm);
  }
  if (!nodes)
    throw UsageError(
        "this organ has no tetrahedra whose nodes could be set; bake it anew "
        "without --set mechanics.fem=false, or set the vertices of its proxy");
  copy_places(xyz_mm, "nodes", count(of), state.nodes_mm);
  nodes->check(state.nodes_mm);
  carry_vertices(*organ.mechanics.body, organ.proxy.vertices, state.nodes_mm, state.vertices_mm);
}

void StateReader::read(std::span<const float> xyz_mm, StateOf of, OrganState& state) const {
  read_numbers(xyz_mm, of, state);
}
void StateReader::read(std::span<const double> xyz_mm, StateOf of, OrganState& state) const {
  read_numbers(xyz_mm, of, state);
}

}  // namespace organbake
