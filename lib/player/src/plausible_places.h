// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace organbake {

// Whether places may be those of a mesh that another program has deformed: told by its size, by
// where it lies, and by edges of it, which tissue does not make several times as long on average.
class PlausiblePlaces {
 public:
  // elements: the mesh's faces or tetrahedra; what: "vertices" or "nodes", for messages.
  template <class Elements>
  PlausiblePlaces(std::string what, const std::vector<Eigen::Vector3d>& rest_mm,
                  const Elements& elements) {
    for (std::size_t e = 0; e < elements.size(); e += 1 + elements.size() / kEdges)
      edges_.push_back({elements[e][0], elements[e][1]});
    begin(std::move(what), rest_mm);
  }

  // Throws UsageError naming what is wrong. As many places as at rest; all finite.
  void check(const std::vector<Eigen::Vector3d>& now_mm) const;

 private:
  static constexpr std::size_t kEdges = 500;
  void begin(std::string what, const std::vector<Eigen::Vector3d>& rest_mm);
  double edges_mm(const std::vector<Eigen::Vector3d>& places_mm) const;  // their mean

  std::string what_;
  std::vector<std::array<std::uint32_t, 2>> edges_;
  Eigen::Vector3d center_mm_ = Eigen::Vector3d::Zero();
  double diagonal_mm_ = 0, edges_mm_ = 0;
};

}  // namespace organbake
