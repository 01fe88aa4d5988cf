// SPDX-License-Identifier: GPL-3.0-or-later
// The triangles of a glTF 2.0 scene (Khronos' specification; its chapters are named where they are
// followed), with all that puts them where they are: nodes, skins and morph weights.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include "meshes/mesh_readers.h"

namespace organbake {
namespace {

constexpr std::int64_t kMostEntries = std::int64_t{1} << 32;

std::size_t index_from(const JsonField& field) {
  return static_cast<std::size_t>(field.integer(0, kMostEntries));
}

// Calls use(entry) for each entry of a list, if there is one.
template <class Use>
void for_each_of(const std::optional<JsonField>& list, const Use& use) {
  for (std::size_t i = 0; list && i < list->size(); ++i) use(list->at(i));
}

std::vector<double> list_of(const JsonField& field, std::size_t count) {
  if (field.size() != count) field.fail("must hold " + std::to_string(count) + " numbers");
  std::vector<double> numbers;
  for (std::size_t i = 0; i < count; ++i) numbers.push_back(field.at(i).number());
  return numbers;
}

Eigen::Quaterniond rotation_of(const double* xyzw, const JsonField& field) {
  const Eigen::Quaterniond rotation(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
  if (!(rotation.norm() > 0)) field.fail("is no rotation");
  return rotation.normalized();
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
  if (const auto turn = node.find("rotation"))
    transform.rotate(rotation_of(list_of(*turn, 4).data(), *turn));
  if (const auto size = node.find("scale"))
    transform.scale(Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(list_of(*size, 3).data())));
  return transform;
}

bool is_among(std::string_view name, std::initializer_list<std::string_view> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Extensions that put nothing elsewhere: looks, lights and facts.
bool is_known_extension(std::string_view name) {
  if (name.find("displacement") != name.npos) return false;
  for (const std::string_view looks : {"_materials_", "_texture_", "_lights_", "KHR_xmp"})
    if (name.find(looks) != name.npos) return true;
  return is_among(name, {"KHR_mesh_quantization", "EXT_mesh_features", "EXT_structural_metadata",
                         "EXT_mesh_manifold", "FB_ngon_encoding", "CESIUM_primitive_outline",
                         "MSFT_lod", "MSFT_screencoverage", "KHR_node_selectability",
                         "KHR_node_hoverability", "KHR_audio_emitter"});
}

// Those that pack numbers which a file that does not require them holds plainly as well.
bool packs_numbers(std::string_view name) {
  return is_among(
      name, {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"});
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
  GltfReader(const std::filesystem::path& path, const RunContext& context)
      : document_(path), root_(document_.root()), name_(path.string()), context_(context) {
    check_what_is_read();
  }

  TriangleMesh read() {
    for (const std::size_t node : first_nodes())
      waiting_.push_back({node, Eigen::Affine3d::Identity()});
    while (!waiting_.empty()) {
      const Placed next = waiting_.back();
      waiting_.pop_back();
      visit(next);
    }
    // Skins take the places of nodes that come later.
    for (const auto& [node, placed] : with_mesh_) append_mesh(root_["nodes"].at(node), placed);
    if (!colored_) mesh_.colors.clear();
    return std::move(mesh_);
  }

 private:
  struct Placed {
    std::size_t node;
    Eigen::Affine3d parent;
  };
  // Where the vertices of a primitive go: all by one transform, or each by its own.
  using Transforms = std::vector<Eigen::Affine3d>;

  // Another version is refused, as is what must be understood and is not; the rest is warned of.
  void check_what_is_read() const {
    const auto asset = root_.find("asset");
    const auto version = asset ? asset->find("version") : std::nullopt;
    if (version && !version->text().starts_with("2."))
      version->fail("is not 2, the version of glTF that is read; save it as that");
    for_each_of(root_.find("extensionsRequired"), [](const JsonField& required) {
      const std::string name = required.text();
      if (!is_known_extension(name)) required.fail("'" + name + "' is not read; save it without");
    });
    for_each_of(root_.find("extensionsUsed"), [&](const JsonField& used) {
      const std::string name = used.text();
      if (!is_known_extension(name) && !packs_numbers(name))
        context_.warn(name_ + ": uses the extension '" + name +
                      "', which is not read: what it changes of the shape is missing; save it "
                      "without");
    });
    const auto animations = root_.find("animations");
    if (animations && animations->size() > 0)
      context_.warn(name_ +
                    ": holds animations, which are not followed: the shape is that of its nodes "
                    "and weights at rest");
  }

  // Those of the scene; without one, every node that is nobody's child.
  std::vector<std::size_t> first_nodes() const {
    std::vector<std::size_t> first;
    const auto scenes = root_.find("scenes"), nodes = root_.find("nodes");
    if (scenes && scenes->size() > 0) {
      const auto which = root_.find("scene");
      const JsonField scene = scenes->at(which ? index_from(*which) : 0);
      for_each_of(scene.find("nodes"),
                  [&](const JsonField& node) { first.push_back(index_from(node)); });
      return first;
    }
    std::set<std::size_t> children;
    for_each_of(nodes, [&](const JsonField& node) {
      for_each_of(node.find("children"),
                  [&](const JsonField& child) { children.insert(index_from(child)); });
    });
    for (std::size_t i = 0; nodes && i < nodes->size(); ++i)
      if (!children.contains(i)) first.push_back(i);
    return first;
  }

  void visit(const Placed& at) {
    const JsonField node = root_["nodes"].at(at.node);
    const Eigen::Affine3d placed = at.parent * transform_of(node);
    if (!world_from_node_.emplace(at.node, placed).second) node.fail("stands in the scene twice");
    if (node.find("mesh")) with_mesh_.emplace_back(at.node, placed);
    for_each_of(node.find("children"), [&](const JsonField& child) {
      waiting_.push_back({index_from(child), placed});
    });
  }

  void append_mesh(const JsonField& node, const Eigen::Affine3d& placed) {
    const JsonField mesh = root_["meshes"].at(index_from(node["mesh"]));
    const JsonField primitives = mesh["primitives"];
    const auto own = node.find("weights"), usual = mesh.find("weights");
    const std::optional<JsonField> weights = own ? own : usual;
    const auto skin = node.find("skin");
    // A skin's joints say all of where it is (glTF 2.0, 3.7.3.3).
    const Transforms joints = skin ? joints_of(root_["skins"].at(index_from(*skin))) : Transforms();
    for (std::size_t i = 0; i < primitives.size(); ++i)
      append(primitives.at(i), weights, joints, placed);
  }

  GltfNumbers vectors(const JsonField& accessor, std::size_t components) const {
    GltfNumbers numbers = document_.numbers(index_from(accessor));
    if (numbers.components != components)
      accessor.fail("must hold " + std::to_string(components) + " numbers each");
    return numbers;
  }

  // From the places of a skin's mesh to the scene, for each joint.
  Transforms joints_of(const JsonField& skin) const {
    Transforms all;
    for_each_of(skin["joints"], [&](const JsonField& joint) {
      const auto node = world_from_node_.find(index_from(joint));
      if (node == world_from_node_.end()) joint.fail("is no node of the scene");
      all.push_back(node->second);
    });
    const auto inverse = skin.find("inverseBindMatrices");
    if (!inverse) return all;
    const GltfNumbers matrices = vectors(*inverse, 16);
    if (matrices.items < all.size()) inverse->fail("are fewer than the joints");
    for (std::size_t i = 0; i < all.size(); ++i) {
      Eigen::Affine3d bind;
      bind.matrix() = Eigen::Map<const Eigen::Matrix4d>(&matrices.values[16 * i]);
      bind.makeAffine();
      all[i] = all[i] * bind;
    }
    return all;
  }

  void append(const JsonField& primitive, const std::optional<JsonField>& weights,
              const Transforms& joints, const Eigen::Affine3d& placed) {
    constexpr int kTriangles = 4, kFan = 6;
    const auto written = primitive.find("mode");
    const int mode = written ? static_cast<int>(written->integer(0, kFan)) : kTriangles;
    if (mode < kTriangles) return;
    const JsonField attributes = primitive["attributes"];
    const auto position = attributes.find("POSITION");
    if (!position) return;
    GltfNumbers places = document_.numbers(index_from(*position));
    if (places.components != 3) position->fail("must be places in space");
    if (!places.written) position->fail("has no bufferView; save it with its numbers");
    const auto before = static_cast<std::uint32_t>(mesh_.vertices.size());
    check_total(primitive, places.items);
    if (weights) morph(primitive, *weights, places);
    const Transforms own =
        joints.empty() ? Transforms() : blended(attributes, joints, places.items);
    for (std::size_t v = 0; v < places.items; ++v)
      mesh_.vertices.push_back((own.empty() ? placed : own[v]) *
                               Eigen::Map<const Eigen::Vector3d>(&places.values[3 * v]));
    append_colors(attributes, places.items);
    const std::vector<std::uint32_t> corners =
        triangle_corners(corners_of(primitive, places.items), mode);
    check_total(primitive, corners.size());
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
      // What mirrors turns its triangles round as well (glTF 2.0, 3.7.4).
      const Eigen::Affine3d& by = own.empty() ? placed : own[corners[i]];
      const std::size_t second = by.linear().determinant() < 0 ? 2 : 1;
      mesh_.faces.push_back(
          {before + corners[i], before + corners[i + second], before + corners[i + 3 - second]});
    }
  }

  // Adds each target's moves by its weight (glTF 2.0, 3.7.2.2).
  void morph(const JsonField& primitive, const JsonField& weights, GltfNumbers& places) const {
    const auto targets = primitive.find("targets");
    if (!targets) return;
    if (weights.size() < targets->size()) weights.fail("are fewer than the targets");
    for (std::size_t t = 0; t < targets->size(); ++t) {
      const double weight = weights.at(t).number();
      const auto position = targets->at(t).find("POSITION");
      if (weight == 0 || !position) continue;
      const GltfNumbers moves = vectors(*position, 3);
      if (moves.items != places.items) position->fail("must hold a move for every vertex");
      for (std::size_t i = 0; i < moves.values.size(); ++i)
        places.values[i] += weight * moves.values[i];
    }
  }

  // For each vertex the mean of its joints' transforms by its weights.
  Transforms blended(const JsonField& attributes, const Transforms& joints,
                     std::size_t vertices) const {
    std::vector<Eigen::Matrix4d> sums(vertices, Eigen::Matrix4d::Zero());
    std::vector<double> totals(vertices, 0);
    for (int set = 0;; ++set) {
      const auto which = attributes.find("JOINTS_" + std::to_string(set)),
                 weights = attributes.find("WEIGHTS_" + std::to_string(set));
      if (!which || !weights) break;
      const GltfNumbers numbers = vectors(*which, 4), shares = vectors(*weights, 4);
      if (numbers.items != vertices || shares.items != vertices)
        which->fail("and weights must be there for every vertex");
      for (std::size_t i = 0; i < 4 * vertices; ++i) {
        if (shares.values[i] == 0) continue;
        const double joint = numbers.values[i];
        if (!(joint >= 0 && joint < static_cast<double>(joints.size())))
          which->fail("name joint " + std::to_string(static_cast<long double>(joint)) + " of " +
                      std::to_string(joints.size()));
        sums[i / 4] += shares.values[i] * joints[static_cast<std::size_t>(joint)].matrix();
        totals[i / 4] += shares.values[i];
      }
    }
    Transforms all(vertices);
    for (std::size_t v = 0; v < vertices; ++v) {
      if (!(totals[v] > 0))
        attributes.fail("give vertex " + std::to_string(v) + " of a skin no weight of a joint");
      all[v].matrix() = sums[v] / totals[v];
      all[v].makeAffine();
    }
    return all;
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
    if (!numbers.written) indices->fail("have no bufferView; save it with its numbers");
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
    used_ += more + 1;  // what is empty takes its time, too
    if (used_ > std::max(kAlwaysFits, document_.total_bytes()))
      primitive.fail("is one of so many that the scene is much larger than its file");
  }

  GltfDocument document_;
  JsonField root_;
  const std::string name_;
  const RunContext& context_;
  TriangleMesh mesh_;
  bool colored_ = true;
  std::size_t used_ = 0;  // vertices and corners so far
  std::vector<Placed> waiting_;
  std::map<std::size_t, Eigen::Affine3d> world_from_node_;
  std::vector<std::pair<std::size_t, Eigen::Affine3d>> with_mesh_;  // in the order of the scene
};

}  // namespace

TriangleMesh read_gltf(const std::filesystem::path& path, const RunContext& context) {
  return GltfReader(path, context).read();
}

}  // namespace organbake
