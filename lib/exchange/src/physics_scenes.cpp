// SPDX-License-Identifier: GPL-3.0-or-later
// A bundle as a scene of SOFA (XML), as a model of MuJoCo (MJCF) and as a mesh of gmsh (MSH 2.2):
// the tetrahedra, or else the springs, with masses and anchors in each program's units and words.
#include <algorithm>
#include <cmath>
#include <vector>

#include "asset_text.h"
#include "organbake/exchange/exports.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

std::string places_text(const std::vector<Vector3d>& places) {
  return joined(places, "  ",
                [](const Vector3d& p) { return metres_text(scene_from_world(p), " "); });
}

template <class Indices>
std::string indices_text(const Indices& indices) {
  return joined(indices, " ", [](std::uint32_t i) { return std::to_string(i); });
}

std::string masses_text(const std::vector<double>& masses) {
  return joined(masses, " ", [](double m) { return to_text(m); });
}

std::string faces_text(const std::vector<Face>& faces) {
  return joined(faces, "  ", [](const Face& f) { return indices_text(f); });
}

// Each anchored node stays where it is; both of SOFA's names for that are of one component, of
// which releases since 22.12 know the first.
std::string anchors_text(const std::vector<std::uint32_t>& anchors) {
  if (anchors.empty()) return "";
  return "    <FixedProjectiveConstraint indices=\"" + indices_text(anchors) + "\"/>\n";
}

std::string solid_text(const TetrahedralBody& body, const MechanicsModel& m) {
  // An element that is partly tissue is as much softer.
  const std::string moduli = joined(body.tetrahedra, " ", [&](const Tetrahedron& t) {
    return to_text(kPascals * m.young_modulus_kpa * t.fill);
  });
  return "    <TetrahedronSetTopologyContainer name=\"topology\" position=\"" +
         places_text(body.nodes_mm) + "\" tetrahedra=\"" +
         joined(body.tetrahedra, "  ", [](const Tetrahedron& t) { return indices_text(t.nodes); }) +
         "\"/>\n    <TetrahedronSetGeometryAlgorithms template=\"Vec3d\"/>\n"
         "    <MechanicalObject name=\"state\" template=\"Vec3d\"/>\n"
         "    <DiagonalMass vertexMass=\"" +
         masses_text(node_masses_kg(body, m.density_kg_per_m3)) +
         "\"/>\n    <TetrahedronFEMForceField method=\"large\" youngModulus=\"" + moduli +
         "\" poissonRatio=\"" + to_text(body.poisson_ratio) + "\"/>\n" + anchors_text(body.anchors);
}

std::string springs_text(const Bundle& bundle) {
  const MechanicsModel& m = bundle.mechanics;
  const auto spring = [](const Spring& s) {
    return std::to_string(s.a) + " " + std::to_string(s.b) + " " +
           to_text(kNewtonsAMetre * s.stiffness_n_per_mm) + " " +
           to_text(kNewtonsAMetre * s.damping_n_s_per_mm) + " " +
           to_text(kMetresAMillimetre * s.rest_length_mm);
  };
  return "    <TriangleSetTopologyContainer name=\"topology\" position=\"" +
         places_text(bundle.proxy.vertices) + "\" triangles=\"" + faces_text(bundle.proxy.faces) +
         "\"/>\n    <TriangleSetGeometryAlgorithms template=\"Vec3d\"/>\n"
         "    <MechanicalObject name=\"state\" template=\"Vec3d\"/>\n"
         "    <DiagonalMass vertexMass=\"" +
         masses_text(m.mass_kg) + "\"/>\n    <StiffSpringForceField spring=\"" +
         joined(m.springs, "  ", spring) + "\"/>\n" + anchors_text(m.anchors);
}

std::string collision_text(const Bundle& bundle) {
  return "    <Node name=\"Collision\">\n      <MeshTopology position=\"" +
         places_text(bundle.proxy.vertices) + "\" triangles=\"" + faces_text(bundle.proxy.faces) +
         "\"/>\n      <MechanicalObject template=\"Vec3d\"/>\n      <TriangleCollisionModel/>\n"
         "      <LineCollisionModel/>\n      <PointCollisionModel/>\n      <BarycentricMapping/>\n"
         "    </Node>\n";
}

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

std::string sofa_text(const Bundle& bundle, const std::string& surface_file,
                      const std::string& color_file) {
  const MechanicsModel& m = bundle.mechanics;
  return "<?xml version=\"1.0\"?>\n"
         "<!-- metres, kilograms, seconds, y up: x left, y superior, z anterior; LPS millimetres: "
         "1000 x, -1000 z, 1000 y -->\n"
         "<Node name=\"root\" dt=\"0.01\" gravity=\"0 -9.81 0\">\n"
         "  <RequiredPlugin pluginName=\"Sofa.Component Sofa.GL.Component\"/>\n"
         "  <DefaultAnimationLoop/>\n  <DefaultVisualManagerLoop/>\n"
         "  <CollisionPipeline/>\n  <BruteForceBroadPhase/>\n  <BVHNarrowPhase/>\n"
         "  <CollisionResponse response=\"PenalityContactForceField\"/>\n"
         "  <MinProximityIntersection alarmDistance=\"0.003\" contactDistance=\"0.001\"/>\n"
         "  <Node name=\"Organ\">\n"
         "    <EulerImplicitSolver rayleighStiffness=\"0.05\" rayleighMass=\"0.05\"/>\n"
         "    <CGLinearSolver iterations=\"100\" tolerance=\"1e-9\" threshold=\"1e-9\"/>\n" +
         (m.body ? solid_text(*m.body, m) : springs_text(bundle)) + collision_text(bundle) +
         "    <Node name=\"Visual\">\n      <MeshOBJLoader name=\"surface\" filename=\"" +
         surface_file + "\"/>\n      <OglModel src=\"@surface\" texturename=\"" + color_file +
         "\"/>\n      <BarycentricMapping/>\n    </Node>\n  </Node>\n</Node>\n";
}

MjcfModel mjcf_model(const Bundle& bundle) {
  const TetrahedralBody& body = tetrahedra_of(bundle, "a flex of MuJoCo");
  const MechanicsModel& m = bundle.mechanics;
  const std::vector<double> masses_kg = node_masses_kg(body, m.density_kg_per_m3);
  const double step_s = stable_step_s(body, m, masses_kg);
  return {
      "<!-- metres, kilograms, seconds; x left, y posterior, z superior (LPS / 1000). At rest "
      "as it was scanned, so without gravity. -->\n"
      "<mujoco model=\"organ\">\n  <option gravity=\"0 0 0\" timestep=\"" +
          to_text(step_s) + "\"/>\n  <size memory=\"" + kMemory + "\"/>\n  <worldbody>\n" +
          nodes_text(body, masses_kg) + "  </worldbody>\n  <deformable>\n" +
          flex_text(body, m, step_s) + "  </deformable>\n</mujoco>\n",
      body.nodes_mm.size(), step_s};
}

std::string gmsh_text(const Bundle& bundle) {
  const TetrahedralBody& body = tetrahedra_of(bundle, "a mesh of gmsh");
  std::string text =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"tissue\"\n"
      "$EndPhysicalNames\n$Nodes\n" +
      std::to_string(body.nodes_mm.size()) + "\n";
  for (std::size_t n = 0; n < body.nodes_mm.size(); ++n)
    text += std::to_string(n + 1) + " " + metres_text(body.nodes_mm[n], " ") + "\n";
  text += "$EndNodes\n$Elements\n" + std::to_string(body.tetrahedra.size()) + "\n";
  for (std::size_t t = 0; t < body.tetrahedra.size(); ++t) {
    constexpr const char* kOneTetrahedron = " 4 2 1 1";  // of 4 nodes; physical and own volume 1
    text += std::to_string(t + 1) + kOneTetrahedron;
    for (const std::uint32_t node : body.tetrahedra[t].nodes)
      text += " " + std::to_string(node + 1);
    text += "\n";
  }
  return text + "$EndElements\n";
}

}  // namespace organbake
