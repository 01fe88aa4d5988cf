// SPDX-License-Identifier: GPL-3.0-or-later
// A bundle as a layer of USD's text format, with a deformable body by the proposal for UsdPhysics
// (OpenUSD-proposals 111), at rest or as time samples of a recorded interaction.
#include "organbake/exchange/exports.h"

#include <numeric>

#include "asset_text.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

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

// A list of them for each frame, as samples of an attribute; nothing without frames.
template <class TextOf>
std::string samples(const char* attribute, const std::vector<std::vector<Vector3d>>& frames,
                    const TextOf& text_of) {
  if (frames.empty()) return "";
  std::string text = std::string("        ") + attribute + ".timeSamples = {\n";
  for (std::size_t f = 0; f < frames.size(); ++f)
    text += "            " + std::to_string(f) + ": [" + joined(frames[f], ", ", text_of) + "],\n";
  return text + "        }\n";
}

std::string direction(const Vector3d& n) {
  const Vector3d turned = scene_direction(n);
  constexpr int kDigits = 5;
  return "(" + to_text(turned.x(), kDigits) + ", " + to_text(turned.y(), kDigits) + ", " +
         to_text(turned.z(), kDigits) + ")";
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

// The schemas of a prim, in its parentheses.
std::string applied(const std::vector<std::string>& schemas) {
  return " (\n        prepend apiSchemas = [" +
         joined(schemas, ", ", [](const std::string& s) { return "\"" + s + "\""; }) +
         "]\n    )\n    {\n";
}

// The proposal's schemas, and the vendor's of the same sense where they are asked for.
std::vector<std::string> schemas(const std::vector<std::string>& names, bool vendor) {
  std::vector<std::string> all = names;
  for (const std::string& name : names)
    if (vendor && (name.starts_with("PhysicsDeformable") || name.ends_with("SimAPI")))
      all.push_back("Omni" + name);
  return all;
}

// Where a mesh lies when what follows the simulation is tied to it.
std::string bind_pose(const std::vector<Vector3d>& places, bool vendor) {
  const std::string purposes = ":purposes = [\"bindPose\"]\n", at = points(places);
  std::string text = "        token[] physics:deformablePose:bind" + purposes +
                     "        point3f[] physics:deformablePose:bind:points = " + at + "\n";
  if (vendor)
    text += "        token[] deformablePose:bind:omniphysics" + purposes +
            "        point3f[] deformablePose:bind:omniphysics:points = " + at + "\n";
  return text;
}

std::string surface_prim(const TexturedMesh& mesh, const UsdOptions& options) {
  std::vector<Face> faces;
  std::vector<std::uint32_t> coordinates;
  for (const auto& face : mesh.faces) {
    faces.push_back({face[0].vertex, face[1].vertex, face[2].vertex});
    for (const TexturedMesh::Corner& corner : face) coordinates.push_back(corner.coordinate);
  }
  const auto coordinate = [](const Eigen::Vector2d& st) {
    return "(" + to_text(st.x(), 7) + ", " + to_text(st.y(), 7) + ")";
  };
  std::vector<std::vector<Vector3d>> normals;
  for (const auto& frame : options.motion.surface_mm)
    normals.push_back(vertex_normals({frame, faces, {}}));
  return "    def Mesh \"Surface\"" +
         applied(schemas({"MaterialBindingAPI", "PhysicsDeformablePoseAPI:bind"},
                         options.vendor_names)) +
         "        float3[] extent = " + extent(mesh.vertices) + "\n" + triangles(faces) +
         "        point3f[] points = " + points(mesh.vertices) + "\n" +
         samples("point3f[] points", options.motion.surface_mm, place) +
         "        normal3f[] normals = [" + joined(mesh.normals, ", ", direction) +
         "] (\n            interpolation = \"vertex\"\n        )\n" +
         samples("normal3f[] normals", normals, direction) +
         "        texCoord2f[] primvars:st = [" + joined(mesh.coordinates, ", ", coordinate) +
         "] (\n            interpolation = \"faceVarying\"\n        )\n"
         "        int[] primvars:st:indices = " +
         numbers_text(coordinates) + "\n" + bind_pose(mesh.vertices, options.vendor_names) +
         "        uniform token subdivisionScheme = \"none\"\n"
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

std::string masses(const std::vector<double>& masses_kg) {
  return "        float[] physics:masses = " + numbers_text(masses_kg) +
         "\n        double[] organbake:masses = " + numbers_text(masses_kg) + "\n";
}

std::string rest_shape(const std::vector<Vector3d>& places, const std::string& elements_name,
                       const std::string& elements, bool vendor) {
  const std::string at = points(places);
  std::string text = "        point3f[] physics:restShapePoints = " + at + "\n        " +
                     elements_name.substr(0, 4) + "[] physics:" + elements_name.substr(5) +
                     "VertexIndices = " + elements + "\n";
  if (vendor)
    text += "        point3f[] omniphysics:restShapePoints = " + at + "\n        " +
            elements_name.substr(0, 4) + "[] omniphysics:" + elements_name.substr(5) +
            "VtxIndices = " + elements + "\n";
  return text;
}

std::string embedding(const TetrahedralBody& body) {
  const auto weights = [](const EmbeddedVertex& v) {
    return "(" + joined(v.weights, ", ", [](double w) { return to_text(w); }) + ")";
  };
  return "        int[] organbake:embeddingTetrahedra = [" +
         joined(body.vertices, ", ",
                [](const EmbeddedVertex& v) { return std::to_string(v.tetrahedron); }) +
         "]\n        double4[] organbake:embeddingWeights = [" +
         joined(body.vertices, ", ", weights) + "]\n";
}

// Where there are tetrahedra those are what is simulated, and the proxy what collides.
std::string proxy_prim(const Bundle& bundle, const UsdOptions& options) {
  const MechanicsModel& m = bundle.mechanics;
  const bool vendor = options.vendor_names;
  std::vector<std::string> apis = {"PhysicsCollisionAPI", "PhysicsDeformablePoseAPI:bind"};
  if (!m.body) apis.insert(apis.end(), {"PhysicsSurfaceDeformableSimAPI", "MaterialBindingAPI"});
  const auto corners = [](const Face& f) {
    return "(" + joined(f, ", ", [](std::uint32_t v) { return std::to_string(v); }) + ")";
  };
  std::string text = "    def Mesh \"Proxy\"" + applied(schemas(apis, vendor)) +
                     "        float3[] extent = " + extent(bundle.proxy.vertices) + "\n" +
                     triangles(bundle.proxy.faces) +
                     "        point3f[] points = " + points(bundle.proxy.vertices) + "\n" +
                     samples("point3f[] points", options.motion.vertices_mm, place) +
                     bind_pose(bundle.proxy.vertices, vendor) +
                     "        uniform token purpose = \"guide\"\n"
                     "        uniform token subdivisionScheme = \"none\"\n"
                     "        int[] organbake:anchors = " +
                     numbers_text(m.anchors) + "\n" + springs_text(m);
  if (m.body) {
    text += "        double[] organbake:masses = " + numbers_text(m.mass_kg) + "\n" +
            embedding(*m.body);
  } else {
    text += masses(m.mass_kg) +
            rest_shape(bundle.proxy.vertices, "int3 restTri",
                       "[" + joined(bundle.proxy.faces, ", ", corners) + "]", vendor) +
            "        uniform token physics:restBendAnglesDefault = \"restShape\"\n"
            "        rel material:binding:physics = </Organ/Tissue>\n";
  }
  return text + "    }\n";
}

std::string body_prim(const MechanicsModel& m, const UsdOptions& options) {
  const TetrahedralBody& body = *m.body;
  const bool vendor = options.vendor_names;
  const auto nodes = [](const Tetrahedron& t) {
    return "(" + joined(t.nodes, ", ", [](std::uint32_t n) { return std::to_string(n); }) + ")";
  };
  const std::string tetrahedra = "[" + joined(body.tetrahedra, ", ", nodes) + "]";
  return "    def TetMesh \"Body\"" +
         applied(schemas({"PhysicsVolumeDeformableSimAPI", "PhysicsDeformablePoseAPI:bind",
                          "MaterialBindingAPI"},
                         vendor)) +
         "        float3[] extent = " + extent(body.nodes_mm) +
         "\n        point3f[] points = " + points(body.nodes_mm) + "\n" +
         samples("point3f[] points", options.motion.nodes_mm, place) +
         "        int4[] tetVertexIndices = " + tetrahedra + "\n" +
         rest_shape(body.nodes_mm, "int4 restTet", tetrahedra, vendor) +
         bind_pose(body.nodes_mm, vendor) + "        uniform token purpose = \"guide\"\n" +
         masses(node_masses_kg(body, m.density_kg_per_m3)) +
         "        double[] organbake:fills = [" +
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

std::string tissue_numbers(const MechanicsModel& m, const std::string& space) {
  std::string text = "        float " + space + ":density = " + to_text(m.density_kg_per_m3) +
                     "\n        float " + space +
                     ":youngsModulus = " + to_text(m.young_modulus_kpa * kPascals) + "\n";
  if (m.body)
    return text + "        float " + space + ":poissonsRatio = " + to_text(m.body->poisson_ratio) +
           "\n";
  return text + "        float " + space +
         ":surfaceThickness = " + to_text(m.thickness_mm * kMetresAMillimetre) + "\n";
}

std::string material_prim(const Bundle& bundle, const TexturedMesh& mesh,
                          const UsdOptions& options) {
  const MechanicsModel& m = bundle.mechanics;
  std::vector<std::string> apis = {
      "PhysicsMaterialAPI",
      m.body ? "PhysicsVolumeDeformableMaterialAPI" : "PhysicsSurfaceDeformableMaterialAPI"};
  if (options.vendor_names)
    apis.push_back(m.body ? "OmniPhysicsDeformableMaterialAPI"
                          : "OmniPhysicsSurfaceDeformableMaterialAPI");
  std::string text = "    def Material \"Tissue\"" + applied(apis) + tissue_numbers(m, "physics");
  if (options.vendor_names) text += tissue_numbers(m, "omniphysics");
  text +=
      "        token outputs:surface.connect = </Organ/Tissue/Preview.outputs:surface>\n"
      "        def Shader \"Preview\"\n        {\n"
      "            uniform token info:id = \"UsdPreviewSurface\"\n"
      "            color3f inputs:diffuseColor.connect = </Organ/Tissue/Color.outputs:rgb>\n";
  if (!options.normal_file.empty())
    text += "            normal3f inputs:normal.connect = </Organ/Tissue/Normals.outputs:rgb>\n";
  text += "            float inputs:roughness = " + to_text(mesh.roughness) +
          "\n            token outputs:surface\n        }\n"
          "        def Shader \"Coordinates\"\n        {\n"
          "            uniform token info:id = \"UsdPrimvarReader_float2\"\n"
          "            string inputs:varname = \"st\"\n"
          "            float2 outputs:result\n        }\n" +
          texture_shader("Color", options.color_file, true);
  if (!options.normal_file.empty()) text += texture_shader("Normals", options.normal_file, false);
  return text + "    }\n";
}

std::string layer_metadata(const UsdOptions& options) {
  std::string text =
      "    defaultPrim = \"Organ\"\n"
      "    doc = \"metres, y up: x left, y superior, z anterior; LPS millimetres: 1000 x, -1000 z, "
      "1000 y. Deformable bodies by the proposal for UsdPhysics (OpenUSD-proposals 111)" +
      std::string(options.vendor_names ? ", and by the names of Omniverse beside them" : "") +
      ".\"\n    kilogramsPerUnit = 1\n    metersPerUnit = 1\n    upAxis = \"Y\"\n";
  const UsdMotion& motion = options.motion;
  if (motion.vertices_mm.empty()) return text;
  return text + "    startTimeCode = 0\n    endTimeCode = " +
         std::to_string(motion.vertices_mm.size() - 1) +
         "\n    timeCodesPerSecond = " + to_text(motion.frames_per_second) + "\n";
}

}  // namespace

std::string usd_text(const Bundle& bundle, const TexturedMesh& surface, const UsdOptions& options) {
  const MechanicsModel& m = bundle.mechanics;
  const std::vector<double> masses_kg =
      m.body ? node_masses_kg(*m.body, m.density_kg_per_m3) : m.mass_kg;
  const std::string mass = to_text(std::accumulate(masses_kg.begin(), masses_kg.end(), 0.0)) + "\n";
  std::vector<std::string> root = schemas({"PhysicsDeformableBodyAPI"}, options.vendor_names);
  return "#usda 1.0\n(\n" + layer_metadata(options) +
         ")\n\ndef Xform \"Organ\" (\n    prepend apiSchemas = [" +
         joined(root, ", ", [](const std::string& s) { return "\"" + s + "\""; }) +
         "]\n    kind = \"component\"\n)\n{\n    float physics:mass = " + mass +
         (options.vendor_names ? "    float omniphysics:mass = " + mass : std::string()) +
         surface_prim(surface, options) + proxy_prim(bundle, options) +
         (m.body ? body_prim(m, options) : std::string()) +
         material_prim(bundle, surface, options) + "}\n";
}

}  // namespace organbake
