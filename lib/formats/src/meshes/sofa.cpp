// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/sofa.h"

#include "meshes/asset_text.h"
#include "organbake/formats/textured_mesh.h"

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

}  // namespace organbake
