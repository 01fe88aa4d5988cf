// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/bundle/cameras_json.h"
#include "organbake/image/channel_image.h"

namespace organbake {

// A mesh with textures, for those who draw with a GPU. A texture coordinate belongs to one vertex
// and one piece of the atlas; a vertex at a seam has several.
struct TexturedMesh {
  struct Corner {
    std::uint32_t vertex = 0, coordinate = 0;
  };
  std::vector<Eigen::Vector3d> vertices;     // mm, LPS
  std::vector<Eigen::Vector3d> normals;      // unit, of each vertex
  std::vector<Eigen::Vector2d> coordinates;  // 0…1, v upwards
  std::vector<Eigen::Vector3d> tangents;     // unit, of each coordinate: along u, across the normal
  std::vector<std::array<Corner, 3>> faces;
  Rgb8Image color;  // sRGB
  // Normals in the frame of tangent, normal × tangent and normal, −1…1 as 0…255; empty: none.
  Rgb8Image normal_map;
  double roughness = 1;  // of a GGX lobe, as glTF has it; 1 = matt
};

// What programs that draw take for space: metres, y up. x is the patient's left, y superior,
// z anterior. Both of the files below are in it.
Eigen::Vector3d scene_from_world(const Eigen::Vector3d& world_mm);
// The same turn for directions.
Eigen::Vector3d scene_direction(const Eigen::Vector3d& world);

// The texts of a Wavefront OBJ file and of its material library, which names the textures' files
// (normal_file empty: none).
std::string obj_text(const TexturedMesh& mesh, const std::string& material_file);
std::string obj_material_text(const TexturedMesh& mesh, const std::string& color_file,
                              const std::string& normal_file);

// The bytes of a .glb file (glTF 2.0): the mesh with its textures inside, and each camera with its
// pose, in glTF's metres and y up (scene_from_world). Cameras look along −z as glTF has them; what
// its pinhole cannot say (principal point, distortion) stands in their extras. Throws BadDataError
// for a mesh without faces.
std::string gltf_binary(const TexturedMesh& mesh, const CameraSet& cameras);

// A recorded interaction, frame by frame, world mm: where the proxy's vertices, the tetrahedra's
// nodes (none of springs) and the textured surface's vertices lay.
struct UsdMotion {
  double frames_per_second = 60;
  std::vector<std::vector<Eigen::Vector3d>> vertices_mm, nodes_mm, surface_mm;
};

struct UsdOptions {
  std::string color_file, normal_file;  // the textures, beside the layer; the second may be empty
  // Also the schemas and attributes of Omniverse, OmniPhysicsDeformableBodyAPI and its like, of the
  // same sense.
  bool vendor_names = false;
  UsdMotion motion;  // as time samples; empty: at rest alone
};

// A bundle for physics engines, in metres, kilograms and seconds, y up (scene_from_world), as USD
// text: /Organ with the textured Surface, the Proxy with the masses of its vertices, its springs
// and anchors, and, when the bundle has them, the Body of tetrahedra with the proxy's embedding in
// it. A deformable body by the proposal for UsdPhysics (OpenUSD-proposals 111): the tetrahedra, or
// else the proxy, are simulated, the proxy collides, the surface follows from its bind pose. What
// the proposal has no place for stands in attributes of the namespace "organbake". Points are
// written to a millionth of a millimetre; USD itself reads them as floats.
std::string usd_text(const Bundle& bundle, const TexturedMesh& surface, const UsdOptions& options);

// A bundle as a scene of SOFA (XML), in metres, kilograms and seconds, y up (scene_from_world):
// finite elements on the tetrahedra where there are any, else the proxy's springs; anchors; the
// proxy as collision model, and the surface, which lies beside it as OBJ, both mapped to what
// moves.
std::string sofa_text(const Bundle& bundle, const std::string& surface_file,
                      const std::string& color_file);

// A bundle's tetrahedra as a model of MuJoCo (MJCF, from version 3): a flex of dimension 3 whose
// nodes are bodies with three slides each and their own mass, those of anchors without slides.
// Metres, kilograms, seconds; the axes of the world: x left, y posterior, z superior. Node i is
// the body "n<i>". MuJoCo has one modulus for all tetrahedra: those that are partly tissue are
// stiffer in it. Its forces are explicit: the time step is as short, and the damping as small, as
// that takes. Throws UsageError for a bundle without tetrahedra.
struct MjcfModel {
  std::string text;
  std::size_t bodies = 0;
  double step_s = 0;
};
MjcfModel mjcf_model(const Bundle& bundle);

// A bundle's tetrahedra as a mesh of gmsh (MSH 2.2, text, which gmsh 4, MuJoCo, SOFA and meshio
// read), in millimetres of the world, LPS; node i has the number i + 1. Throws UsageError for a
// bundle without tetrahedra.
std::string gmsh_text(const Bundle& bundle);

}  // namespace organbake
