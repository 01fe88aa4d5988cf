// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/nrrd_reader.h"

#include <algorithm>
#include <optional>

#include "files/header_text.h"
#include "files/nrrd_header.h"
#include "files/time_points.h"
#include "grid/affine_grid.h"
#include "grid/sheared_grid.h"
#include "labels/mask_labels.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

using AxisVector = std::optional<Eigen::Vector3d>;  // nothing for an axis that is not in space

// "(1,0,0) (0,1,0) none (0,0,1)"
std::vector<AxisVector> space_directions(const NrrdHeader& header) {
  const std::string text = header.get("space directions");
  std::vector<AxisVector> directions;
  for (std::size_t at = 0; (at = text.find_first_not_of(" \t", at)) != std::string::npos;) {
    if (text[at] != '(') {
      directions.push_back(std::nullopt);  // "none"
      at = std::min(text.find_first_of(" \t", at), text.size());
      continue;
    }
    const std::size_t close = text.find(')', at);
    if (close == std::string::npos) header.fail("space directions lack a bracket");
    const auto values =
        numbers(text.substr(at, close + 1 - at), header.path().string() + ": space directions");
    if (values.size() != 3) header.fail("space directions need three numbers each");
    directions.push_back(Eigen::Vector3d(values[0], values[1], values[2]));
    at = close + 1;
  }
  return directions;
}

// The three axes that span the volume, and the one of several volumes: segments that overlap, or
// times.
struct NrrdAxes {
  std::vector<std::size_t> in_space;
  std::int64_t volumes = 1;
  bool interleaved = false;  // the volumes' axis is the fastest
};

NrrdAxes axes_of(const NrrdHeader& header, const std::vector<std::int64_t>& sizes,
                 const std::vector<AxisVector>& directions) {
  const std::string dimensions = "has " + std::to_string(sizes.size()) + " dimensions; ";
  if (!directions.empty() && directions.size() != sizes.size()) {
    header.fail("has " + std::to_string(sizes.size()) + " sizes but " +
                std::to_string(directions.size()) + " space directions");
  }
  NrrdAxes axes;
  std::size_t extra = sizes.size();
  for (std::size_t i = 0, dropped = 0; i < sizes.size(); ++i) {
    const bool spare = dropped + 3 < sizes.size();
    const bool drop = spare && (directions.empty() ? sizes[i] == 1 : !directions[i]);
    dropped += drop;
    if (!drop) {
      axes.in_space.push_back(i);
    } else if (sizes[i] != 1) {
      if (axes.volumes != 1) header.fail(dimensions + "a 3-D volume is needed");
      axes.volumes = sizes[i];
      extra = i;
    }
  }
  // Without directions the last of four is time, as programs write it.
  if (directions.empty() && axes.in_space.size() == 4) {
    extra = 3;
    axes.volumes = sizes[3];
    axes.in_space.pop_back();
  }
  std::size_t with_direction = 0;
  for (const AxisVector& direction : directions) with_direction += direction.has_value();
  if (axes.in_space.size() != 3 || (!directions.empty() && with_direction != 3)) {
    header.fail(dimensions + "a 3-D volume is needed");
  }
  if (axes.volumes != 1 && extra != 0 && extra + 1 != sizes.size()) {
    header.fail("has its volumes along axis " + std::to_string(extra) +
                "; the first or the last is needed");
  }
  axes.interleaved = axes.volumes != 1 && extra == 0;
  return axes;
}

// Diagonal that turns the file's world into LPS.
Eigen::Vector3d lps_from_space(const NrrdHeader& header, Volume& volume) {
  const std::string space = lower_case(header.get("space"));
  if (space == "left-posterior-superior" || space == "lps") return {1, 1, 1};
  if (space == "right-anterior-superior" || space == "ras") return {-1, -1, 1};
  if (space == "left-anterior-superior" || space == "las") return {1, -1, 1};
  volume.warnings.push_back("the NRRD header's space \"" + space +
                            "\" does not tell left from right; LPS was assumed");
  return {1, 1, 1};
}

void check_units(const NrrdHeader& header) {
  const std::string units = lower_case(header.get("space units"));
  if (units.empty() || units.find("\"mm\"") != std::string::npos) return;
  header.fail("space units " + units + "; millimetres are needed");
}

Eigen::Matrix3d axes_without_directions(const NrrdHeader& header,
                                        const std::vector<std::size_t>& axes, Volume& volume) {
  const auto spacings = numbers(header.get("spacings"), header.path().string() + ": spacings");
  if (spacings.empty()) {
    volume.warnings.push_back("the NRRD header has no spacings; 1 mm was assumed");
    return Eigen::Matrix3d::Identity();
  }
  if (spacings.size() <= axes.back()) header.fail("has fewer spacings than sizes");
  return Eigen::Vector3d(spacings[axes[0]], spacings[axes[1]], spacings[axes[2]]).asDiagonal();
}

NrrdAxes place(const NrrdHeader& header, Volume& volume, Shear& shear) {
  const std::string name = header.path().string();
  const auto sizes = integers(header.get("sizes"), name + ": sizes");
  if (static_cast<std::int64_t>(sizes.size()) != header.integer("dimension", -1)) {
    header.fail("has " + std::to_string(sizes.size()) + " sizes for dimension " +
                header.get("dimension"));
  }
  const std::vector<AxisVector> directions = space_directions(header);
  const NrrdAxes all = axes_of(header, sizes, directions);
  const std::vector<std::size_t>& axes = all.in_space;
  checked_voxel_count({sizes[axes[0]], sizes[axes[1]], sizes[axes[2]]}, name);
  check_units(header);

  Eigen::Matrix3d columns;
  if (directions.empty()) columns = axes_without_directions(header, axes, volume);
  for (int i = 0; i < 3; ++i) {
    volume.size[i] = static_cast<int>(sizes[axes[i]]);
    if (!directions.empty()) columns.col(i) = *directions[axes[i]];
  }
  const auto origin = numbers(header.get("space origin"), name + ": space origin");
  if (!origin.empty() && origin.size() != 3) header.fail("space origin needs three numbers");
  const Eigen::Vector3d lps = lps_from_space(header, volume);
  const Eigen::Vector3d at =
      origin.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(origin[0], origin[1], origin[2]);
  shear = set_grid_or_shear(volume, lps.asDiagonal() * columns, lps.cwiseProduct(at), name);
  return all;
}

// 3D Slicer's segments: "Segment0_Name:=liver", "Segment0_LabelValue:=1", "Segment0_Layer:=0".
std::vector<LabelName> segments_of(const NrrdHeader& header) {
  std::vector<LabelName> names;
  for (int i = 0;; ++i) {
    const std::string segment = "Segment" + std::to_string(i) + "_";
    std::string name = header.note(segment + "Name");
    if (name.empty()) name = header.note(segment + "ID");
    if (name.empty()) return names;
    const auto number = [&](const char* key, int otherwise) {
      const std::string text = header.note(segment + key);
      if (text.empty()) return otherwise;
      const auto values = integers(text, header.path().string() + ": " + segment + key);
      if (values.size() != 1) header.fail(segment + key + " needs one number");
      return static_cast<int>(values[0]);
    };
    names.push_back({number("LabelValue", i + 1), name, number("Layer", 0)});
  }
}

}  // namespace

Volume read_nrrd(const std::filesystem::path& path, const VolumeReadOptions& options) {
  const NrrdHeader header(path);
  Volume volume;
  Shear shear;
  const NrrdAxes axes = place(header, volume, shear);
  volume.label_names = segments_of(header);
  const VoxelEncoding encoding = header.encoding();
  const std::uint64_t count =
      checked_voxel_count({volume.size[0], volume.size[1], volume.size[2]}, path.string());
  const std::uint64_t bytes =
      count * static_cast<std::uint64_t>(axes.volumes) * bytes_of(encoding.type);
  const auto read_one = [&](std::int64_t which) {
    return decode_region(header.open_data(bytes),
                         {encoding, header.is_text(), which, axes.volumes, axes.interleaved},
                         options, shear, path.string(), volume);
  };
  // Layers of one segmentation are not times: they lie over one another, and labels choose.
  if (!volume.label_names.empty() && axes.volumes > 1) {
    return read_layers(axes.volumes, options, path.string(), volume.label_names, read_one);
  }
  volume.time_points = axes.volumes;
  return read_one_of({axes.volumes, {}}, options, path.string(), read_one);
}

}  // namespace organbake
