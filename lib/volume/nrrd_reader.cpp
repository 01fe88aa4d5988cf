// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/nrrd_reader.h"

#include <algorithm>
#include <optional>

#include "core/error.h"
#include "volume/grid.h"
#include "volume/header_text.h"
#include "volume/nrrd_header.h"

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

// The three axes that span the volume. Others (time, channels) must have size 1.
std::vector<std::size_t> spatial_axes(const NrrdHeader& header,
                                      const std::vector<std::int64_t>& sizes,
                                      const std::vector<AxisVector>& directions) {
  if (!directions.empty() && directions.size() != sizes.size()) {
    header.fail("has " + std::to_string(sizes.size()) + " sizes but " +
                std::to_string(directions.size()) + " space directions");
  }
  std::vector<std::size_t> axes;
  std::size_t in_space = 0;
  for (const AxisVector& direction : directions) in_space += direction.has_value();
  for (std::size_t i = 0, dropped = 0; i < sizes.size(); ++i) {
    const bool droppable = sizes[i] == 1 && dropped + 3 < sizes.size();
    const bool drop = directions.empty() ? droppable : !directions[i] && sizes[i] == 1;
    dropped += drop;
    if (!drop) axes.push_back(i);
  }
  if (axes.size() != 3 || (!directions.empty() && in_space != 3)) {
    header.fail("has " + std::to_string(sizes.size()) + " dimensions; a 3-D volume is needed");
  }
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

void place(const NrrdHeader& header, Volume& volume) {
  const std::string name = header.path().string();
  const auto sizes = integers(header.get("sizes"), name + ": sizes");
  if (static_cast<std::int64_t>(sizes.size()) != header.integer("dimension", -1)) {
    header.fail("has " + std::to_string(sizes.size()) + " sizes for dimension " +
                header.get("dimension"));
  }
  const std::vector<AxisVector> directions = space_directions(header);
  const std::vector<std::size_t> axes = spatial_axes(header, sizes, directions);
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
  set_grid(volume, lps.asDiagonal() * columns, lps.cwiseProduct(at), name);
}

}  // namespace

Volume read_nrrd(const std::filesystem::path& path, const VolumeReadOptions& options) {
  const NrrdHeader header(path);
  Volume volume;
  place(header, volume);
  const VoxelEncoding encoding = header.encoding();
  const std::uint64_t bytes =
      checked_voxel_count({volume.size[0], volume.size[1], volume.size[2]}, path.string()) *
      bytes_of(encoding.type);
  ByteStream stream = header.open_data(bytes);
  return decode_region(stream, encoding, header.is_text(), options.region, path.string(),
                       std::move(volume));
}

}  // namespace organbake
