// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/mjcf.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "meshes/asset_text.h"
#include "meshes/tetrahedra_of.h"

namespace organbake {
namespace {

// MuJoCo asks for an inertia of every body, though these never turn: of a cube of this edge.
constexpr double kCube_m = 0.005;
constexpr double kLongestStep_s = 0.002;
// MuJoCo's contacts are as stiff as their mass and time constant make them. Nodes are so light that
// they give way to anything but the shortest one, which must not be mixed with the tool's.
constexpr double kContactSteps = 2;
// For contacts. Left to itself MuJoCo takes gigabytes for so many slides.
constexpr const char* kMemory = "200M";

// Elastic forces are explicit in MuJoCo: stable below 2/ω, and with a damping of τ where ω² τ times
// the step stays below 1. A quarter of the first leaves room for a τ of that step. No node's ω² is
// more than 4 k/m, with k its own entry of the stiffness of whole tetrahedra.
double stable_step_s(const TetrahedralBody& body, const MechanicsModel& m,
                     const std::vector<double>& masses_kg) {
  const double e = m.young_modulus_kpa * kPascals, nu = body.poisson_ratio;
  const double modulus_pa = e * (1 - nu) / ((1 + nu) * (1 - 2 * nu));  // under lateral constraint
  std::vector<double> stiffness(masses_kg.size(), 0.0);                // N/m
  for (const Tetrahedron& t : body.tetrahedra) {
    const auto gradients = gradients_of(body, t);
    const double volume_mm3 = volume_of(body, t);
    for (int k = 0; k < 4; ++k)
      stiffness[t.nodes[k]] +=
          modulus_pa * volume_mm3 * gradients.row(k).squaredNorm() * kMetresAMillimetre;
  }
  double largest = 0;  // ω²
  for (std::size_t n = 0; n < masses_kg.size(); ++n)
    largest = std::max(largest, 4 * stiffness[n] / masses_kg[n]);
  return std::min(kLongestStep_s, 0.5 / std::sqrt(largest));
}

std::string nodes_text(const TetrahedralBody& body, const std::vector<double>& masses_kg) {
  std::string text;
  for (std::uint32_t n = 0; n < body.nodes_mm.size(); ++n) {
    text += "    <body name=\"n" + std::to_string(n) + "\" pos=\"" +
            metres_text(kMetresAMillimetre * body.nodes_mm[n], " ") + "\"";
    if (std::binary_search(body.anchors.begin(), body.anchors.end(), n)) {
      text += "/>\n";
      continue;
    }
    const std::string inertia = to_text(masses_kg[n] * kCube_m * kCube_m / 6);
    text += "><inertial pos=\"0 0 0\" mass=\"" + to_text(masses_kg[n]) + "\" diaginertia=\"" +
            inertia + " " + inertia + " " + inertia +
            "\"/><joint type=\"slide\" axis=\"1 0 0\"/><joint type=\"slide\" axis=\"0 1 0\"/>"
            "<joint type=\"slide\" axis=\"0 0 1\"/></body>\n";
  }
  return text;
}

std::string flex_text(const TetrahedralBody& body, const MechanicsModel& m, double step_s) {
  std::string bodies;
  for (std::size_t n = 0; n < body.nodes_mm.size(); ++n)
    bodies += (n == 0 ? "n" : " n") + std::to_string(n);
  const auto nodes = [](const Tetrahedron& t) {
    return joined(t.nodes, " ", [](std::uint32_t n) { return std::to_string(n); });
  };
  return "    <flex name=\"organ\" dim=\"3\" radius=\"0.0005\" body=\"" + bodies + "\" element=\"" +
         joined(body.tetrahedra, "  ", nodes) + "\">\n      <elasticity young=\"" +
         to_text(m.young_modulus_kpa * kPascals) + "\" poisson=\"" + to_text(body.poisson_ratio) +
         "\" damping=\"" + to_text(std::min(body.damping_s, step_s)) +
         "\"/>\n      <contact selfcollide=\"none\" internal=\"false\" priority=\"1\" solref=\"" +
         to_text(kContactSteps * step_s) + " 1\"/>\n    </flex>\n";
}

}  // namespace

std::string mjcf_text(const Bundle& bundle) {
  const TetrahedralBody& body = tetrahedra_of(bundle, "a flex of MuJoCo");
  const MechanicsModel& m = bundle.mechanics;
  const std::vector<double> masses_kg = node_masses_kg(body, m.density_kg_per_m3);
  const double step_s = stable_step_s(body, m, masses_kg);
  return "<!-- metres, kilograms, seconds; x left, y posterior, z superior (LPS / 1000). At rest "
         "as it was scanned, so without gravity. -->\n"
         "<mujoco model=\"organ\">\n  <option gravity=\"0 0 0\" timestep=\"" +
         to_text(step_s) + "\"/>\n  <size memory=\"" + kMemory + "\"/>\n  <worldbody>\n" +
         nodes_text(body, masses_kg) + "  </worldbody>\n  <deformable>\n" +
         flex_text(body, m, step_s) + "  </deformable>\n</mujoco>\n";
}

}  // namespace organbake
