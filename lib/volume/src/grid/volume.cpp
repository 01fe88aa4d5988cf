// SPDX-License-Identifier: GPL-3.0-or-later
// A volume: its values and labels, the memory that they lie in, a box of it, and its figures.
#include "organbake/volume/volume.h"

#include <sys/mman.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>
#include <Eigen/LU>
#include <algorithm>
#include <cstdlib>
#include <limits>
#include <type_traits>

#include "files/volume_files.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {
namespace {

// Directions come from decimal text or float32; a hundredth of a degree moves a voxel by 0.05 mm
// at 300 mm.
constexpr double kOrthonormalTolerance = 2e-4;
// Beyond these no scan was made: the header is damaged, or its units are others.
constexpr double kLeastSpacing_mm = 1e-6, kMostSpacing_mm = 1e6;

std::string in_voxels(const std::array<int, 3>& size) {
  return std::to_string(size[0]) + "×" + std::to_string(size[1]) + "×" + std::to_string(size[2]);
}

}  // namespace

void make_real(Volume& volume) {
  if (volume.is_real()) return;
  volume.reals.assign(volume.voxels.begin(), volume.voxels.end());
  volume.voxels = {};
}

void make_labels(Volume& volume) {
  if (!volume.is_real()) return;
  std::size_t not_whole = 0;
  for (float& value : volume.reals) {
    const float whole = std::isnan(value) ? 0 : std::nearbyint(value);
    not_whole += std::abs(value - whole) > 0;
    value = whole;
  }
  if (not_whole > 0)
    volume.warnings.push_back(std::to_string(not_whole) + " of " +
                              std::to_string(volume.voxel_count()) +
                              " voxels are no whole numbers; each was taken as the nearest label");
  const ValueRange range = value_range(volume);
  if (range.max > kMostLabel)
    volume.warnings.push_back("labels beyond " + std::to_string(kMostLabel) +
                              " cannot be told apart");
  if (range.min < std::numeric_limits<std::int16_t>::min() ||
      range.max > std::numeric_limits<std::int16_t>::max())
    return;
  volume.voxels.resize(volume.reals.size());
  std::transform(volume.reals.begin(), volume.reals.end(), volume.voxels.begin(),
                 [](float label) { return static_cast<std::int16_t>(label); });
  volume.reals = {};
}

ValueRange value_range(const Volume& volume) {
  return with_values(volume, [](const auto values) {
    using Value = typename std::remove_cvref_t<decltype(values)>::value_type;
    using Limits = std::numeric_limits<Value>;
    struct Found {
      Value low = Limits::max(), high = Limits::lowest();
      bool has_nan = false;
    };
    constexpr std::size_t kGrain = std::size_t{1} << 20;
    const Found found = tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, values.size(), kGrain), Found(),
        [&](const auto& block, Found so_far) {
          // Two plain loops' worth of min and max, which compilers vectorise; minmax_element is
          // branchy. A NaN is never less.
          Value low = so_far.low, high = so_far.high;
          bool has_nan = so_far.has_nan;
          for (std::size_t i = block.begin(); i < block.end(); ++i) {
            low = values[i] < low ? values[i] : low;
            high = high < values[i] ? values[i] : high;
            if constexpr (Limits::has_quiet_NaN) has_nan |= values[i] != values[i];
          }
          return Found{low, high, has_nan};
        },
        [](const Found& a, const Found& b) {
          return Found{std::min(a.low, b.low), std::max(a.high, b.high), a.has_nan || b.has_nan};
        });
    if (found.high < found.low) return ValueRange{0, 0, found.has_nan};
    return ValueRange{static_cast<double>(found.low), static_cast<double>(found.high),
                      found.has_nan};
  });
}

void check_volume(const Volume& volume, const std::string& name) {
  std::size_t expected = 1;
  for (const int n : volume.size) {
    if (n < 1) throw BadDataError(name + ": a volume of " + in_voxels(volume.size) + " voxels");
    expected *= static_cast<std::size_t>(n);
  }
  if (volume.voxel_count() != expected)
    throw BadDataError(name + ": " + std::to_string(volume.voxel_count()) + " values for " +
                       in_voxels(volume.size) + " voxels");
  for (int axis = 0; axis < 3; ++axis) {
    const double spacing = volume.spacing_mm[axis];
    if (!(spacing >= kLeastSpacing_mm && spacing <= kMostSpacing_mm))
      throw BadDataError(name + ": the voxel spacing along axis " + std::to_string(axis) + " is " +
                         to_text(spacing) + " mm; it must be in 1e-6…1e6");
  }
  const Eigen::Matrix3d& d = volume.direction;
  if (!d.allFinite() || !within_reach(volume.origin_mm))
    throw BadDataError(name +
                       ": the volume's direction is not finite, or its origin is not within "
                       "1e9 mm");
  if ((d.transpose() * d - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() >
      kOrthonormalTolerance)
    throw BadDataError(name + ": the volume's axes are not perpendicular unit vectors");
}

std::vector<double> slice_gaps_mm(const Volume& volume) {
  std::vector<double> gaps;
  const std::vector<Eigen::Vector3d>& corners = volume.slices.corners_mm;
  for (std::size_t k = 1; k < corners.size(); ++k)
    gaps.push_back((corners[k] - corners[k - 1]).dot(volume.direction.col(2)));
  return gaps;
}

bool same_grid(const Volume& a, const Volume& b) {
  if (a.size != b.size) return false;
  const double tolerance = 0.01 * std::min(a.spacing_mm.minCoeff(), b.spacing_mm.minCoeff());
  // The eight corners bound every voxel between them.
  const Eigen::Vector3d last(a.size[0] - 1, a.size[1] - 1, a.size[2] - 1);
  for (const Eigen::Vector3d& index : corners_of(Eigen::Vector3d::Zero(), last))
    if ((a.world_from_index(index) - b.world_from_index(index)).norm() > tolerance) return false;
  return true;
}

// Large pieces are mapped, in huge pages where the system has them: a volume of half a gigabyte
// would be asked for in 130,000 small ones.
namespace {

constexpr std::size_t kMapped = std::size_t{1} << 22;

}  // namespace

void* allocate_zeroed(std::size_t bytes) {
  if (bytes < kMapped) {
    void* const memory = std::calloc(bytes > 0 ? bytes : 1, 1);
    if (!memory) throw std::bad_alloc();
    return memory;
  }
  void* const memory =
      ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  ::madvise(memory, bytes, MADV_HUGEPAGE);  // a hint
  return memory;
}

void free_zeroed(void* memory, std::size_t bytes) noexcept {
  if (bytes < kMapped) {
    std::free(memory);
  } else {
    ::munmap(memory, bytes);
  }
}

Region parse_region(const std::string& text, const std::string& where) {
  std::vector<double> values;
  try {
    values = numbers(text, where);
  } catch (const BadDataError&) {
    values.clear();  // a slip on the command line is a usage error, said below
  }
  if (values.size() != 6)
    throw UsageError(where + ": '" + text +
                     "' is not possible; it takes two corners, x0,y0,z0,x1,y1,z1 in mm (LPS)");
  const Eigen::Vector3d a(values[0], values[1], values[2]), b(values[3], values[4], values[5]);
  const Region region = {a.cwiseMin(b), a.cwiseMax(b)};
  if (!((region.max_mm - region.min_mm).minCoeff() > 0))
    throw UsageError(where + ": '" + text + "' is a box without volume");
  return region;
}

std::optional<IndexBox> voxels_within(const Volume& grid, const Region& region) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e30), high = -low;
  for (const Eigen::Vector3d& world : corners_of(region.min_mm, region.max_mm)) {
    const Eigen::Vector3d index = grid.index_from_world(world);
    low = low.cwiseMin(index);
    high = high.cwiseMax(index);
  }
  IndexBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const double last = grid.size[axis] - 1;
    const double first = std::clamp(std::floor(low[axis]) - 1, 0.0, last);
    const double end = std::clamp(std::ceil(high[axis]) + 1, 0.0, last);
    if (low[axis] > last + 0.5 || high[axis] < -0.5) return std::nullopt;
    box.first[axis] = static_cast<int>(first);
    box.size[axis] = static_cast<int>(end - first) + 1;
  }
  return box;
}

IndexBox voxels_of_region(const Volume& grid, const Region& region, const std::string& name) {
  const std::optional<IndexBox> box = voxels_within(grid, region);
  if (box) return *box;
  throw BadDataError(name + ": the region of interest lies outside the volume, which covers " +
                     world_range_text(grid) + " mm (LPS)");
}

void crop_grid(Volume& grid, const IndexBox& box) {
  grid.origin_mm = grid.world_from_index(Eigen::Vector3d(box.first[0], box.first[1], box.first[2]));
  grid.size = box.size;
}

Volume cropped(Volume volume, const IndexBox& box) {
  if (box.is_whole(volume)) return volume;
  // In place: every row moves towards the front, past what has been read already.
  with_values(volume, [&](const auto values) {
    auto to = values.begin();
    for (int k = 0; k < box.size[2]; ++k) {
      for (int j = 0; j < box.size[1]; ++j) {
        const std::size_t row = std::size_t(box.first[2] + k) * volume.size[1] + box.first[1] + j;
        const auto from = values.subspan(row * volume.size[0] + box.first[0], box.size[0]);
        to = std::copy(from.begin(), from.end(), to);
      }
    }
  });
  crop_grid(volume, box);
  const auto shrink = [&](auto& values) {
    values.resize(box.voxels());
    values.shrink_to_fit();
  };
  volume.is_real() ? shrink(volume.reals) : shrink(volume.voxels);
  return volume;
}

namespace {

char side_towards(const Eigen::Vector3d& axis) {
  Eigen::Index along = 0;
  axis.cwiseAbs().maxCoeff(&along);
  return axis[along] >= 0 ? "LPS"[along] : "RAI"[along];
}

std::string triple(const Eigen::Vector3d& v) {
  return to_text(v.x(), 1) + ", " + to_text(v.y(), 1) + ", " + to_text(v.z(), 1);
}

}  // namespace

VolumeFigures volume_figures(const Volume& volume) {
  VolumeFigures figures;
  figures.size = volume.size;
  figures.spacing_mm = volume.spacing_mm;
  figures.min_mm = figures.max_mm = volume.origin_mm;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d direction = volume.direction.col(axis);
    figures.extent_mm[axis] = volume.size[axis] * volume.spacing_mm[axis];
    figures.orientation += side_towards(direction);
    const double cosine = std::min(1.0, direction.cwiseAbs().maxCoeff());
    figures.oblique_degrees = std::max(figures.oblique_degrees, std::acos(cosine) * 180 / M_PI);
    const Eigen::Vector3d along = direction * volume.spacing_mm[axis] * (volume.size[axis] - 1);
    figures.min_mm += along.cwiseMin(0);
    figures.max_mm += along.cwiseMax(0);
  }
  figures.left_handed = volume.direction.determinant() < 0;
  figures.range = value_range(volume);
  return figures;
}

std::string world_range_text(const Volume& volume) {
  const VolumeFigures f = volume_figures(volume);
  return triple(f.min_mm) + " … " + triple(f.max_mm);
}

}  // namespace organbake
