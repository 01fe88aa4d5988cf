// SPDX-License-Identifier: GPL-3.0-or-later
// A textured mesh as glTF 2.0 (.glb, Khronos' specification) with its cameras, and as Wavefront OBJ
// with its material: metres, y up.
#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/exchange/exports.h"
#include "organbake/image/png.h"

namespace organbake {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963, kFloat = 5126, kUnsignedInt = 5125,
              kLinear = 9729, kLinearMipmapLinear = 9987,
              kClampToEdge = 33071;  // OpenGL's numbers, as glTF has them

template <class Value>
void append(std::string& bytes, Value value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof value);
}

// OpenGL's camera looks along −z with y up, ours along +z with y down.
Json camera_node(const PosedCamera& camera, std::size_t index) {
  const RigidTransform world_from_camera = camera.camera_from_world.inverse();
  const Eigen::Matrix3d axes = world_from_camera.rotation * Eigen::Vector3d(1, -1, -1).asDiagonal();
  Eigen::Matrix3d turned;
  for (int k = 0; k < 3; ++k) turned.col(k) = scene_direction(axes.col(k));
  const Eigen::Quaterniond q(turned);
  const Eigen::Vector3d at = scene_from_world(world_from_camera.translation);
  return {{"name", camera.name},
          {"camera", index},
          {"rotation", {q.x(), q.y(), q.z(), q.w()}},
          {"translation", {at.x(), at.y(), at.z()}}};
}

Json camera_lens(const PosedCamera& camera) {
  const Intrinsics& k = camera.intrinsics;
  constexpr double kNear_m = 0.001;
  return {{"type", "perspective"},
          {"name", camera.name},
          {"perspective",
           {{"yfov", 2 * std::atan(k.height / (2 * k.fy))},
            {"aspectRatio", k.width * k.fy / (k.height * k.fx)},
            {"znear", kNear_m}}},
          {"extras",
           {{"width", k.width},
            {"height", k.height},
            {"fx", k.fx},
            {"fy", k.fy},
            {"cx", k.cx},
            {"cy", k.cy},
            {"distortion_k1_k2_p1_p2_k3", {k.k1, k.k2, k.p1, k.p2, k.k3}}}}};
}

std::string chunk(const char* type, std::string bytes, char padding) {
  while (bytes.size() % 4 != 0) bytes += padding;
  std::string text;
  append(text, static_cast<std::uint32_t>(bytes.size()));
  return text + std::string(type, 4) + bytes;
}

// The one buffer of the file, with the views and accessors that tell what lies where.
class GlbBuffer {
 public:
  // Each returns the number of its accessor. Components are floats.
  std::size_t add_vectors(const std::vector<Eigen::VectorXf>& vectors, const char* type,
                          bool with_bounds) {
    const std::size_t start = begin();
    for (const Eigen::VectorXf& v : vectors)
      for (const float component : v) append(bytes_, component);
    end(start, kArrayBuffer);
    Json accessor = {{"bufferView", views_.size() - 1},
                     {"componentType", kFloat},
                     {"count", vectors.size()},
                     {"type", type}};
    if (with_bounds) {
      // Of the floats, which is what a checker compares with.
      Eigen::VectorXf least = vectors.front(), most = vectors.front();
      for (const Eigen::VectorXf& v : vectors) least = least.cwiseMin(v), most = most.cwiseMax(v);
      accessor["min"] = std::vector<float>(least.begin(), least.end());
      accessor["max"] = std::vector<float>(most.begin(), most.end());
    }
    accessors_.push_back(accessor);
    return accessors_.size() - 1;
  }
  std::size_t add_indices(const std::vector<std::uint32_t>& indices) {
    const std::size_t start = begin();
    for (const std::uint32_t index : indices) append(bytes_, index);
    end(start, kElementArrayBuffer);
    accessors_.push_back({{"bufferView", views_.size() - 1},
                          {"componentType", kUnsignedInt},
                          {"count", indices.size()},
                          {"type", "SCALAR"}});
    return accessors_.size() - 1;
  }
  // The number of its view.
  std::size_t add_file(const std::string& file) {
    const std::size_t start = begin();
    bytes_ += file;
    end(start, 0);
    return views_.size() - 1;
  }

  void describe(Json& json) const {
    json["accessors"] = accessors_;
    json["bufferViews"] = views_;
    const Json buffer = {{"byteLength", bytes_.size()}};
    json["buffers"] = Json::array({buffer});
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::size_t begin() {
    while (bytes_.size() % 4 != 0) bytes_ += '\0';
    return bytes_.size();
  }
  void end(std::size_t start, int target) {
    Json view = {{"buffer", 0}, {"byteOffset", start}, {"byteLength", bytes_.size() - start}};
    if (target != 0) view["target"] = target;
    views_.push_back(view);
  }

  std::string bytes_;
  Json views_ = Json::array(), accessors_ = Json::array();
};

Eigen::VectorXf floats(const Eigen::Vector3d& v) { return v.cast<float>(); }

// glTF has one index for all of a corner: our texture coordinates, each of which has one vertex.
Json primitive_of(const TexturedMesh& mesh, GlbBuffer& buffer) {
  std::vector<std::uint32_t> vertex_of(mesh.coordinates.size(), 0), indices;
  for (const auto& face : mesh.faces)
    for (const TexturedMesh::Corner& corner : face) {
      vertex_of[corner.coordinate] = corner.vertex;
      indices.push_back(corner.coordinate);
    }
  std::vector<Eigen::VectorXf> places, normals, tangents, coordinates;
  for (std::size_t c = 0; c < vertex_of.size(); ++c) {
    places.push_back(floats(scene_from_world(mesh.vertices[vertex_of[c]])));
    normals.push_back(floats(scene_direction(mesh.normals[vertex_of[c]])));
    const Eigen::Vector3d t = scene_direction(mesh.tangents[c]);
    // w = 1: the texture lies on the surface as it is seen from outside, nowhere mirrored.
    tangents.push_back(Eigen::Vector4d(t.x(), t.y(), t.z(), 1).cast<float>());
    const Eigen::Vector2d& uv = mesh.coordinates[c];
    coordinates.push_back(Eigen::Vector2d(uv.x(), 1 - uv.y()).cast<float>());
  }
  Json attributes = {{"POSITION", buffer.add_vectors(places, "VEC3", true)},
                     {"NORMAL", buffer.add_vectors(normals, "VEC3", false)},
                     {"TEXCOORD_0", buffer.add_vectors(coordinates, "VEC2", false)}};
  if (!mesh.normal_map.pixels.empty())
    attributes["TANGENT"] = buffer.add_vectors(tangents, "VEC4", false);
  return {{"attributes", attributes}, {"indices", buffer.add_indices(indices)}, {"material", 0}};
}

void add_texture(Json& json, GlbBuffer& buffer, const Rgb8Image& image, const char* name) {
  json["images"].push_back({{"name", name},
                            {"bufferView", buffer.add_file(encode_png(image))},
                            {"mimeType", "image/png"}});
  json["textures"].push_back({{"sampler", 0}, {"source", json["images"].size() - 1}});
}

void add_material(Json& json, GlbBuffer& buffer, const TexturedMesh& mesh) {
  add_texture(json, buffer, mesh.color, "colour");
  Json material = {{"name", "tissue"},
                   {"pbrMetallicRoughness",
                    {{"baseColorTexture", {{"index", 0}}},
                     {"metallicFactor", 0.0},
                     {"roughnessFactor", mesh.roughness}}}};
  if (!mesh.normal_map.pixels.empty()) {
    add_texture(json, buffer, mesh.normal_map, "microstructure");
    material["normalTexture"] = {{"index", 1}};
  }
  json["materials"] = Json::array({material});
  const Json sampler = {{"magFilter", kLinear},
                        {"minFilter", kLinearMipmapLinear},
                        {"wrapS", kClampToEdge},
                        {"wrapT", kClampToEdge}};
  json["samplers"] = Json::array({sampler});
}

constexpr const char* kMaterial = "tissue";
constexpr double kMetresPerMillimetre = 0.001;
constexpr int kMetreDigits = 7;  // a ten-thousandth of a millimetre
constexpr int kUnitDigits = 6;

std::string line_of(const char* key, const Eigen::Vector3d& v, int digits) {
  return std::string(key) + " " + to_text(v.x(), digits) + " " + to_text(v.y(), digits) + " " +
         to_text(v.z(), digits) + "\n";
}

}  // namespace

std::string gltf_binary(const TexturedMesh& mesh, const CameraSet& cameras) {
  if (mesh.faces.empty()) throw BadDataError("surface: no faces to export");
  GlbBuffer buffer;
  Json json = {{"asset",
                {{"version", "2.0"},
                 {"generator", "organbake"},
                 {"extras", {{"axes", "metres; x left, y superior, z anterior"}}}}},
               {"scene", 0}};
  const Json part = {{"name", "organ"}, {"primitives", Json::array({primitive_of(mesh, buffer)})}};
  json["meshes"] = Json::array({part});
  add_material(json, buffer, mesh);

  const Json organ = {{"name", "organ"}, {"mesh", 0}};
  Json nodes = Json::array({organ}), lenses = Json::array(), roots = Json::array({0});
  for (std::size_t c = 0; c < cameras.cameras.size(); ++c) {
    roots.push_back(nodes.size());
    nodes.push_back(camera_node(cameras.cameras[c], c));
    lenses.push_back(camera_lens(cameras.cameras[c]));
  }
  const Json scene = {{"nodes", roots}};
  json["scenes"] = Json::array({scene});
  json["nodes"] = nodes;
  if (!lenses.empty()) json["cameras"] = lenses;
  buffer.describe(json);

  const std::string body = chunk("JSON", json.dump(), ' ') + chunk("BIN\0", buffer.bytes(), '\0');
  constexpr std::uint32_t kVersion = 2, kHeaderBytes = 12;
  std::string bytes = "glTF";
  append(bytes, kVersion);
  append(bytes, static_cast<std::uint32_t>(kHeaderBytes + body.size()));
  return bytes + body;
}

Eigen::Vector3d scene_direction(const Eigen::Vector3d& world) {
  return {world.x(), world.z(), -world.y()};
}

Eigen::Vector3d scene_from_world(const Eigen::Vector3d& world_mm) {
  return kMetresPerMillimetre * scene_direction(world_mm);
}

std::string obj_text(const TexturedMesh& mesh, const std::string& material_file) {
  std::string text =
      "# metres, y up: x left, y superior, z anterior\n"
      "# LPS millimetres: 1000 x, -1000 z, 1000 y\nmtllib " +
      material_file + "\nusemtl " + kMaterial + "\n";
  for (const Eigen::Vector3d& v : mesh.vertices)
    text += line_of("v", scene_from_world(v), kMetreDigits);
  for (const Eigen::Vector2d& t : mesh.coordinates)
    text += "vt " + to_text(t.x(), kUnitDigits) + " " + to_text(t.y(), kUnitDigits) + "\n";
  for (const Eigen::Vector3d& n : mesh.normals)
    text += line_of("vn", scene_direction(n), kUnitDigits);
  for (const auto& face : mesh.faces) {
    text += "f";
    for (const TexturedMesh::Corner& corner : face) {
      const std::string vertex = std::to_string(corner.vertex + 1);
      text += " " + vertex + "/" + std::to_string(corner.coordinate + 1) + "/" + vertex;
    }
    text += "\n";
  }
  return text;
}

std::string obj_material_text(const TexturedMesh& mesh, const std::string& color_file,
                              const std::string& normal_file) {
  std::string text = std::string("newmtl ") + kMaterial +
                     "\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nPr " + to_text(mesh.roughness, 3) +
                     "\nPm 0\nmap_Kd " + color_file + "\n";
  if (!normal_file.empty()) text += "norm " + normal_file + "\n";
  return text;
}

}  // namespace organbake
