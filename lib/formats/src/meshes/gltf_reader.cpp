// SPDX-License-Identifier: GPL-3.0-or-later
#include "meshes/gltf_reader.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "meshes/gltf_accessors.h"

namespace organbake {
namespace {

constexpr std::int64_t kMostEntries = std::int64_t{1} << 32;

std::size_t index_from(const JsonField& field) {
  return static_cast<std::size_t>(field.integer(0, kMostEntries));
}

std::vector<double> list_of(const JsonField& field, std::size_t count) {
  if (field.size() != count) field.fail("must hold " + std::to_string(count) + " numbers");
  std::vector<double> numbers;
  for (std::size_t i = 0; i < count; ++i) numbers.push_back(field.at(i).number());
  return numbers;
}

Eigen::Affine3d transform_of(const JsonField& node) {
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  if (const auto matrix = node.find("matrix")) {
    transform.matrix() = Eigen::Map<const Eigen::Matrix4d>(list_of(*matrix, 16).data());
    transform.makeAffine();
    return transform;
  }
  if (const auto move = node.find("translation"))
    transform.translate(Eigen::Map<const Eigen::Vector3d>(list_of(*move, 3).data()));
  if (const auto turn = node.find("rotation")) {
    const std::vector<double> q = list_of(*turn, 4);  // x, y, z, w
    const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
    if (!(rotation.norm() > 0)) turn->fail("is no rotation");
    transform.rotate(rotation.normalized());
  }
  if (const auto size = node.find("scale"))
    transform.scale(Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(list_of(*size, 3).data())));
  return transform;
}

// Corners in threes, however the primitive lists them.
std::vector<std::uint32_t> triangle_corners(const std::vector<std::uint32_t>& list, int mode) {
  constexpr int kStrip = 5, kFan = 6;
  if (mode != kStrip && mode != kFan) return list;
  std::vector<std::uint32_t> corners;
  for (std::size_t i = 2; i < list.size(); ++i) {
    if (mode == kFan) {
      corners.insert(corners.end(), {list[0], list[i - 1], list[i]});
    } else {
      const bool odd = i % 2 == 1;
      corners.insert(corners.end(),
                     {list[odd ? i - 1 : i - 2], list[odd ? i - 2 : i - 1], list[i]});
    }
  }
  return corners;
}

class GltfReader {
 public:
  explicit GltfReader(const std::filesystem::path& path)
      : document_(path), root_(document_.root()) {
    check_extensions();
  }

  TriangleMesh read() {
    for (const auto& [node, parent] : first_nodes()) add(node, parent);
    while (!waiting_.empty()) {
      const auto [node, parent] = waiting_.back();
      waiting_.pop_back();
      visit(node, parent);
    }
    if (!colored_) mesh_.colors.clear();
    return std::move(mesh_);
  }

 private:
  using Placed = std::pair<std::size_t, Eigen::Affine3d>;

  void check_extensions() const {
    const auto required = root_.find("extensionsRequired");
    for (std::size_t i = 0; required && i < required->size(); ++i) {
      const std::string name = required->at(i).text();
      const bool harmless = name == "KHR_mesh_quantization" ||
                            name.find("_material") != name.npos ||
                            name.find("_texture") != name.npos;
      if (!harmless) required->at(i).fail("'" + name + "' is not read; save it without");
    }
  }

  // Those of the scene; without one, every node that is nobody's child.
  std::vector<Placed> first_nodes() const {
    std::vector<Placed> first;
    const auto scenes = root_.find("scenes");
    if (scenes && scenes->size() > 0) {
      const auto which = root_.find("scene");
      const JsonField scene = scenes->at(which ? index_from(*which) : 0);
      const auto nodes = scene.find("nodes");
      for (std::size_t i = 0; nodes && i < nodes->size(); ++i)
        first.emplace_back(index_from(nodes->at(i)), Eigen::Affine3d::Identity());
      return first;
    }
    const auto nodes = root_.find("nodes");
    std::set<std::size_t> children;
    for (std::size_t i = 0; nodes && i < nodes->size(); ++i) {
      const auto below = nodes->at(i).find("children");
      for (std::size_t c = 0; below && c < below->size(); ++c)
        children.insert(index_from(below->at(c)));
    }
    for (std::size_t i = 0; nodes && i < nodes->size(); ++i)
      if (!children.contains(i)) first.emplace_back(i, Eigen::Affine3d::Identity());
    return first;
  }

  void add(std::size_t node, const Eigen::Affine3d& parent) { waiting_.emplace_back(node, parent); }

  void visit(std::size_t index, const Eigen::Affine3d& parent) {
    const JsonField node = root_["nodes"].at(index);
    if (!seen_.insert(index).second) node.fail("stands in the scene twice");
    const Eigen::Affine3d placed = parent * transform_of(node);
    if (const auto mesh = node.find("mesh")) {
      const JsonField primitives = root_["meshes"].at(index_from(*mesh))["primitives"];
      for (std::size_t i = 0; i < primitives.size(); ++i) append(primitives.at(i), placed);
    }
    const auto children = node.find("children");
    for (std::size_t i = 0; children && i < children->size(); ++i)
      add(index_from(children->at(i)), placed);
  }

  void append(const JsonField& primitive, const Eigen::Affine3d& placed) {
    constexpr int kTriangles = 4, kFan = 6;
    const auto written = primitive.find("mode");
    const int mode = written ? static_cast<int>(written->integer(0, kFan)) : kTriangles;
    if (mode < kTriangles) return;
    const JsonField attributes = primitive["attributes"];
    const auto position = attributes.find("POSITION");
    if (!position) return;
    const GltfNumbers places = document_.numbers(index_from(*position));
    if (places.components != 3) position->fail("must be places in space");
    const auto before = static_cast<std::uint32_t>(mesh_.vertices.size());
    check_total(primitive, places.items);
    for (std::size_t v = 0; v < places.items; ++v)
      mesh_.vertices.push_back(placed * Eigen::Map<const Eigen::Vector3d>(&places.values[3 * v]));
    append_colors(attributes, places.items);
    const std::vector<std::uint32_t> corners =
        triangle_corners(corners_of(primitive, places.items), mode);
    check_total(primitive, corners.size());
    // What mirrors turns its triangles round as well (glTF 2.0, 3.7.4).
    const std::size_t second = placed.linear().determinant() < 0 ? 2 : 1;
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
      mesh_.faces.push_back(
          {before + corners[i], before + corners[i + second], before + corners[i + 3 - second]});
  }

  std::vector<std::uint32_t> corners_of(const JsonField& primitive, std::size_t vertices) const {
    std::vector<std::uint32_t> corners;
    const auto indices = primitive.find("indices");
    if (!indices) {
      for (std::size_t v = 0; v < vertices; ++v) corners.push_back(static_cast<std::uint32_t>(v));
      return corners;
    }
    const GltfNumbers numbers = document_.numbers(index_from(*indices));
    if (numbers.components != 1) indices->fail("must be single numbers");
    for (const double number : numbers.values) {
      if (!(number >= 0 && number < static_cast<double>(vertices) && number == std::floor(number)))
        indices->fail("name vertex " + std::to_string(static_cast<long double>(number)) + " of " +
                      std::to_string(vertices));
      corners.push_back(static_cast<std::uint32_t>(number));
    }
    return corners;
  }

  void append_colors(const JsonField& attributes, std::size_t vertices) {
    const auto color = attributes.find("COLOR_0");
    if (!color) colored_ = false;
    if (!colored_) return;
    const GltfNumbers numbers = document_.numbers(index_from(*color));
    if (numbers.items != vertices || numbers.components < 3)
      color->fail("must hold a colour for every vertex");
    for (std::size_t v = 0; v < vertices; ++v) {
      const double* rgb = &numbers.values[v * numbers.components];
      mesh_.colors.emplace_back(float(rgb[0]), float(rgb[1]), float(rgb[2]));
    }
  }

  // A mesh may stand in the scene many times, but no small file makes a large one by that.
  void check_total(const JsonField& primitive, std::size_t more) {
    constexpr std::size_t kAlwaysFits = 1'000'000;
    used_ += more;
    if (used_ > std::max(kAlwaysFits, document_.total_bytes()))
      primitive.fail("is one of so many that the scene is much larger than its file");
  }

  GltfDocument document_;
  JsonField root_;
  TriangleMesh mesh_;
  bool colored_ = true;
  std::size_t used_ = 0;  // vertices and corners so far
  std::set<std::size_t> seen_;
  std::vector<Placed> waiting_;
};

}  // namespace

TriangleMesh read_gltf(const std::filesystem::path& path) { return GltfReader(path).read(); }

}  // namespace organbake
