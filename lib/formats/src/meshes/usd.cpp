// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/usd.h"

#include <algorithm>
#include <numeric>

#include "meshes/asset_text.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kNewtonsAMetre = 1000;  // of N/mm, and likewise of damping
constexpr double kPascals = 1000;        // of kPa
constexpr double kMetresAMillimetre = 0.001;

std::string place(const Vector3d& world_mm) {
  return "(" + metres_text(scene_from_world(world_mm), ", ") + ")";
}

template <class Numbers>
std::string numbers_text(const Numbers& numbers) {
  return "[" + joined(numbers, ", ", [](auto n) { return to_text(double(n)); }) + "]";
}

std::string points(const std::vector<Vector3d>& places) {
  return "[" + joined(places, ", ", place) + "]";
}

std::string extent(const std::vector<Vector3d>& places) {
  Vector3d low = scene_from_world(places.front()), high = low;
  for (const Vector3d& p : places) {
    low = low.cwiseMin(scene_from_world(p));
    high = high.cwiseMax(scene_from_world(p));
  }
  return "[(" + metres_text(low, ", ") + "), (" + metres_text(high, ", ") + ")]";
}

std::string triangles(const std::vector<Face>& faces) {
  return "        int[] faceVertexCounts = [" +
         joined(faces, ", ", [](const Face&) { return std::string("3"); }) +
         "]\n        int[] faceVertexIndices = [" +
         joined(faces, ", ",
                [](const Face& f) {
                  return std::to_string(f[0]) + ", " + std::to_string(f[1]) + ", " +
                         std::to_string(f[2]);
                }) +
         "]\n";
}

constexpr const char* kApplied = " (\n        prepend apiSchemas = [";

std::string surface_prim(const TexturedMesh& mesh) {
  std::vector<Face> faces;
  std::vector<std::uint32_t> coordinates;
  for (const auto& face : mesh.faces) {
    faces.push_back({face[0].vertex, face[1].vertex, face[2].vertex});
    for (const TexturedMesh::Corner& corner : face) coordinates.push_back(corner.coordinate);
  }
  const auto direction = [](const Vector3d& n) {
    return "(" + metres_text(scene_direction(n), ", ") + ")";
  };
  const auto coordinate = [](const Eigen::Vector2d& st) {
    return "(" + to_text(st.x(), 7) + ", " + to_text(st.y(), 7) + ")";
  };
  return std::string("    def Mesh \"Surface\"") + kApplied +
         "\"MaterialBindingAPI\"]\n    )\n    {\n"
         "        float3[] extent = " +
         extent(mesh.vertices) + "\n" + triangles(faces) +
         "        point3f[] points = " + points(mesh.vertices) +
         "\n        normal3f[] normals = [" + joined(mesh.normals, ", ", direction) +
         "] (\n            interpolation = \"vertex\"\n        )\n"
         "        texCoord2f[] primvars:st = [" +
         joined(mesh.coordinates, ", ", coordinate) +
         "] (\n            interpolation = \"faceVarying\"\n        )\n"
         "        int[] primvars:st:indices = " +
         numbers_text(coordinates) +
         "\n        uniform token subdivisionScheme = \"none\"\n"
         "        rel material:binding = </Organ/Tissue>\n    }\n";
}

std::string springs_text(const MechanicsModel& m) {
  const auto ends = [](const Spring& s) {
    return "(" + std::to_string(s.a) + ", " + std::to_string(s.b) + ")";
  };
  const auto numbers = [&](const char* name, double Spring::*member, double scale) {
    return std::string("        double[] organbake:") + name + " = [" +
           joined(m.springs, ", ", [&](const Spring& s) { return to_text(s.*member * scale); }) +
           "]\n";
  };
  return "        int2[] organbake:springs = [" + joined(m.springs, ", ", ends) + "]\n" +
         numbers("springRestLengths", &Spring::rest_length_mm, kMetresAMillimetre) +
         numbers("springStiffnesses", &Spring::stiffness_n_per_mm, kNewtonsAMetre) +
         numbers("springDampings", &Spring::damping_n_s_per_mm, kNewtonsAMetre);
}

std::string deformable(const char* kind, double mass_kg) {
  return std::string(kApplied) + "\"OmniPhysicsDeformableBodyAPI\", \"" + kind +
         "\", \"PhysicsCollisionAPI\", \"MaterialBindingAPI\"]\n    )\n    {\n"
         "        float omniphysics:mass = " +
         to_text(mass_kg) + "\n";
}

std::string proxy_prim(const Bundle& bundle) {
  const MechanicsModel& m = bundle.mechanics;
  const double mass = std::accumulate(m.mass_kg.begin(), m.mass_kg.end(), 0.0);
  // Where there are tetrahedra, those are what is simulated.
  std::string text =
      std::string("    def Mesh \"Proxy\"") +
      (m.body ? "\n    {\n" : deformable("OmniPhysicsSurfaceDeformableSimAPI", mass));
  text += "        float3[] extent = " + extent(bundle.proxy.vertices) + "\n" +
          triangles(bundle.proxy.faces) +
          "        point3f[] points = " + points(bundle.proxy.vertices) +
          "\n        uniform token purpose = \"guide\"\n"
          "        uniform token subdivisionScheme = \"none\"\n"
          "        double[] organbake:masses = " +
          numbers_text(m.mass_kg) +
          "\n        int[] organbake:anchors = " + numbers_text(m.anchors) + "\n" + springs_text(m);
  if (m.body) {
    const auto weights = [](const EmbeddedVertex& v) {
      return "(" + joined(v.weights, ", ", [](double w) { return to_text(w); }) + ")";
    };
    text += "        int[] organbake:embeddingTetrahedra = [" +
            joined(m.body->vertices, ", ",
                   [](const EmbeddedVertex& v) { return std::to_string(v.tetrahedron); }) +
            "]\n        double4[] organbake:embeddingWeights = [" +
            joined(m.body->vertices, ", ", weights) + "]\n";
  } else {
    text += "        rel material:binding:physics = </Organ/Tissue>\n";
  }
  return text + "    }\n";
}

std::string body_prim(const TetrahedralBody& body, double density_kg_per_m3) {
  const std::vector<double> masses = node_masses_kg(body, density_kg_per_m3);
  const auto nodes = [](const Tetrahedron& t) {
    return "(" + joined(t.nodes, ", ", [](std::uint32_t n) { return std::to_string(n); }) + ")";
  };
  const std::string tetrahedra = "[" + joined(body.tetrahedra, ", ", nodes) + "]";
  return std::string("    def TetMesh \"Body\"") +
         deformable("OmniPhysicsVolumeDeformableSimAPI",
                    std::accumulate(masses.begin(), masses.end(), 0.0)) +
         "        float3[] extent = " + extent(body.nodes_mm) +
         "\n        point3f[] points = " + points(body.nodes_mm) +
         "\n        int4[] tetVertexIndices = " + tetrahedra +
         "\n        point3f[] omniphysics:restShapePoints = " + points(body.nodes_mm) +
         "\n        int4[] omniphysics:restTetVtxIndices = " + tetrahedra +
         "\n        uniform token purpose = \"guide\"\n"
         "        double[] organbake:masses = " +
         numbers_text(masses) + "\n        double[] organbake:fills = [" +
         joined(body.tetrahedra, ", ", [](const Tetrahedron& t) { return to_text(t.fill); }) +
         "]\n        int[] organbake:anchors = " + numbers_text(body.anchors) +
         "\n        rel material:binding:physics = </Organ/Tissue>\n    }\n";
}

std::string texture_shader(const char* name, const std::string& file, bool color) {
  return std::string("        def Shader \"") + name +
         "\"\n        {\n            uniform token info:id = \"UsdUVTexture\"\n"
         "            asset inputs:file = @./" +
         file + "@\n            token inputs:sourceColorSpace = \"" + (color ? "sRGB" : "raw") +
         "\"\n            float2 inputs:st.connect = </Organ/Tissue/Coordinates.outputs:result>\n" +
         (color ? ""
                : "            float4 inputs:scale = (2, 2, 2, 1)\n"
                  "            float4 inputs:bias = (-1, -1, -1, 0)\n") +
         "            float3 outputs:rgb\n        }\n";
}

std::string material_prim(const Bundle& bundle, const TexturedMesh& mesh,
                          const std::string& color_file, const std::string& normal_file) {
  const MechanicsModel& m = bundle.mechanics;
  std::string text = std::string("    def Material \"Tissue\"") + kApplied +
                     "\"OmniPhysicsDeformableMaterialAPI\"]\n    )\n    {\n"
                     "        float omniphysics:density = " +
                     to_text(m.density_kg_per_m3) + "\n        float omniphysics:youngsModulus = " +
                     to_text(m.young_modulus_kpa * kPascals) + "\n";
  if (m.body)
    text += "        float omniphysics:poissonsRatio = " + to_text(m.body->poisson_ratio) + "\n";
  text +=
      "        token outputs:surface.connect = </Organ/Tissue/Preview.outputs:surface>\n"
      "        def Shader \"Preview\"\n        {\n"
      "            uniform token info:id = \"UsdPreviewSurface\"\n"
      "            color3f inputs:diffuseColor.connect = </Organ/Tissue/Color.outputs:rgb>\n";
  if (!normal_file.empty())
    text += "            normal3f inputs:normal.connect = </Organ/Tissue/Normals.outputs:rgb>\n";
  text += "            float inputs:roughness = " + to_text(mesh.roughness) +
          "\n            token outputs:surface\n        }\n"
          "        def Shader \"Coordinates\"\n        {\n"
          "            uniform token info:id = \"UsdPrimvarReader_float2\"\n"
          "            string inputs:varname = \"st\"\n"
          "            float2 outputs:result\n        }\n" +
          texture_shader("Color", color_file, true);
  if (!normal_file.empty()) text += texture_shader("Normals", normal_file, false);
  return text + "    }\n";
}

}  // namespace

std::string usd_text(const Bundle& bundle, const TexturedMesh& surface,
                     const std::string& color_file, const std::string& normal_file) {
  const MechanicsModel& m = bundle.mechanics;
  return std::string(
             "#usda 1.0\n(\n    defaultPrim = \"Organ\"\n"
             "    doc = \"metres, y up: x left, y superior, z anterior; LPS millimetres: 1000 x, "
             "-1000 z, 1000 y. Deformable bodies by the proposal of the USD Physics working group, "
             "as published under the prefix OmniPhysics.\"\n"
             "    kilogramsPerUnit = 1\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\n"
             "def Xform \"Organ\" (\n    kind = \"component\"\n)\n{\n") +
         surface_prim(surface) + proxy_prim(bundle) +
         (m.body ? body_prim(*m.body, m.density_kg_per_m3) : std::string()) +
         material_prim(bundle, surface, color_file, normal_file) + "}\n";
}

}  // namespace organbake
