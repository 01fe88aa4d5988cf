// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/gltf.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/error.h"

namespace organbake {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963, kFloat = 5126,
              kUnsignedInt = 5125;  // OpenGL's numbers, as glTF has them

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
  const Eigen::Quaterniond q(axes);
  const Eigen::Vector3d& at = world_from_camera.translation;
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

std::string buffer_of(const TriangleMesh& mesh) {
  std::string bytes;
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    for (int k = 0; k < 3; ++k) append(bytes, static_cast<float>(vertex[k]));
  for (const Face& face : mesh.faces)
    for (const std::uint32_t corner : face) append(bytes, corner);
  return bytes;
}

Json mesh_json(const TriangleMesh& mesh) {
  const std::size_t positions = mesh.vertices.size() * 3 * sizeof(float);
  const std::size_t indices = mesh.faces.size() * 3 * sizeof(std::uint32_t);
  // The bounds of the floats, which is what a checker compares with.
  const Eigen::Vector3f least = bounds(mesh).min.cast<float>(),
                        most = bounds(mesh).max.cast<float>();
  Json json;
  const Json primitive = {{"attributes", {{"POSITION", 0}}}, {"indices", 1}};
  const Json part = {{"name", "proxy"}, {"primitives", Json::array({primitive})}};
  json["meshes"] = Json::array({part});
  const Json places = {{"bufferView", 0},
                       {"componentType", kFloat},
                       {"count", mesh.vertices.size()},
                       {"type", "VEC3"},
                       {"min", {least.x(), least.y(), least.z()}},
                       {"max", {most.x(), most.y(), most.z()}}};
  const Json corners = {{"bufferView", 1},
                        {"componentType", kUnsignedInt},
                        {"count", 3 * mesh.faces.size()},
                        {"type", "SCALAR"}};
  json["accessors"] = Json::array({places, corners});
  const Json first = {
      {"buffer", 0}, {"byteOffset", 0}, {"byteLength", positions}, {"target", kArrayBuffer}};
  const Json second = {{"buffer", 0},
                       {"byteOffset", positions},
                       {"byteLength", indices},
                       {"target", kElementArrayBuffer}};
  json["bufferViews"] = Json::array({first, second});
  const Json buffer = {{"byteLength", positions + indices}};
  json["buffers"] = Json::array({buffer});
  return json;
}

}  // namespace

std::string gltf_binary(const TriangleMesh& mesh, const CameraSet& cameras) {
  if (mesh.empty()) throw BadDataError("proxy: no faces to export");
  const Json scene = {{"nodes", Json::array({0})}};
  Json json = {{"asset", {{"version", "2.0"}, {"generator", "organbake"}}},
               {"scene", 0},
               {"scenes", Json::array({scene})}};
  json.update(mesh_json(mesh));
  constexpr double kMetresPerMillimetre = 0.001;
  const double half = std::sqrt(0.5);  // a quarter turn about x
  Json children = Json::array({1}), nodes = Json::array(), lenses = Json::array();
  nodes.push_back({{"name", "metres from LPS millimetres"},
                   {"rotation", {-half, 0.0, 0.0, half}},
                   {"scale", std::vector<double>(3, kMetresPerMillimetre)}});
  nodes.push_back({{"name", "proxy"}, {"mesh", 0}});
  for (std::size_t c = 0; c < cameras.cameras.size(); ++c) {
    children.push_back(nodes.size());
    nodes.push_back(camera_node(cameras.cameras[c], c));
    lenses.push_back(camera_lens(cameras.cameras[c]));
  }
  nodes[0]["children"] = children;
  json["nodes"] = nodes;
  if (!lenses.empty()) json["cameras"] = lenses;

  const std::string body = chunk("JSON", json.dump(), ' ') + chunk("BIN\0", buffer_of(mesh), '\0');
  constexpr std::uint32_t kVersion = 2, kHeaderBytes = 12;
  std::string bytes = "glTF";
  append(bytes, kVersion);
  append(bytes, static_cast<std::uint32_t>(kHeaderBytes + body.size()));
  return bytes + body;
}

}  // namespace organbake
