// SPDX-License-Identifier: GPL-3.0-or-later
// A CT volume from the slices of a series: as they are where they lie evenly and upright, else
// interpolated on an upright grid (gantry tilt, uneven gaps).
#include "dicom/dicom.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// Resampled at a time: the decoded slices of a few are all that is held beside the volume.
constexpr int kSlicesAtATime = 16;

// The grid of the stack as it was scanned, by its first slice.
Volume scanned_grid(const DicomStack& stack, const fs::path& folder) {
  const DicomSlice& first = stack.slices.front();
  Volume grid;
  const auto slices = static_cast<std::int64_t>(stack.slices.size());
  set_size(grid, {first.columns, first.rows, slices}, folder.string());
  Eigen::Matrix3d axes;
  axes << first.row_axis * first.pixel_mm.x(), first.column_axis * first.pixel_mm.y(),
      first.normal() * stack.spacing_mm;
  set_grid(grid, axes, first.position_mm, folder.string());
  return grid;
}

// Bilinear sample of plane k at a continuous (column, row); `air` beyond its pixels.
double sample(const Volume& stack, int k, double x, double y, double air) {
  const double left = std::floor(x), top = std::floor(y);
  const double fx = x - left, fy = y - top;
  const auto pixel = [&](double column, double row) -> double {
    if (column < 0 || row < 0 || column >= stack.size[0] || row >= stack.size[1]) return air;
    return stack.at(static_cast<int>(column), static_cast<int>(row), k);
  };
  // A whole-pixel position takes its one pixel, so that the last column is not mixed with air.
  const double right = fx > 0 ? left + 1 : left, bottom = fy > 0 ? top + 1 : top;
  const double upper = (1 - fx) * pixel(left, top) + fx * pixel(right, top);
  const double lower = (1 - fx) * pixel(left, bottom) + fx * pixel(right, bottom);
  return (1 - fy) * upper + fy * lower;
}

// The plane below a place along the normal, and how far it lies towards the next.
struct Between {
  int below = 0;
  double share = 0;
};

Between find_between(const std::vector<double>& along_mm, double at_mm) {
  const auto above = std::upper_bound(along_mm.begin(), along_mm.end(), at_mm);
  const auto last = static_cast<std::ptrdiff_t>(along_mm.size()) - 2;
  const auto below = std::clamp<std::ptrdiff_t>(above - along_mm.begin() - 1, 0, last);
  const double gap = along_mm[below + 1] - along_mm[below];
  return {static_cast<int>(below), std::clamp((at_mm - along_mm[below]) / gap, 0.0, 1.0)};
}

// Whole pixels that hold all drifts, the first and the last.
Eigen::Vector2d least_px(const std::vector<Eigen::Vector2d>& drifts) {
  Eigen::Vector2d least = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& drift : drifts) least = least.cwiseMin(drift);
  return least.array().floor();
}

// The upright grid, in slices of spacing_mm, that a stack with gantry tilt or uneven gaps, sorted
// along its normal, is resampled to, without voxels. It grows by the shifts, so nothing is cut off.
// `first` is the grid of the stack's first plane.
Volume upright_grid(const PlaneStack& stack, const Volume& first, double spacing_mm,
                    const std::string& name) {
  const Eigen::Vector2d corner = least_px(stack.drift_px);
  Eigen::Vector2d most = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& drift : stack.drift_px) most = most.cwiseMax(drift);
  Volume grid;
  grid.spacing_mm = first.spacing_mm;
  grid.spacing_mm[2] = spacing_mm;
  grid.direction = first.direction;
  grid.origin_mm = first.world_from_index({corner.x(), corner.y(), 0});
  constexpr double kRoundingSlack = 1e-6;  // the last slice must not be lost to a last digit
  const auto slices =
      static_cast<std::int64_t>(std::floor(stack.along_mm.back() / spacing_mm + kRoundingSlack)) +
      1;
  const std::array<std::int64_t, 3> size = {
      first.size[0] + static_cast<std::int64_t>(std::ceil(most.x()) - corner.x()),
      first.size[1] + static_cast<std::int64_t>(std::ceil(most.y()) - corner.y()), slices};
  set_size(grid, size, name);
  return grid;
}

// Planes [first, end) of a stack.
struct PlaneRange {
  int first = 0, end = 0;
  int count() const { return end - first; }
};
// Those that slices [k, k_end) of the upright grid lie between.
PlaneRange planes_needed(const PlaneStack& stack, double spacing_mm, int k, int k_end) {
  return {find_between(stack.along_mm, k * spacing_mm).below,
          find_between(stack.along_mm, (k_end - 1) * spacing_mm).below + 2};
}

// Fills slices [k, k + count) of the upright grid's box `box` (k counted from the box's first) from
// the decoded planes `range` of the stack, by linear interpolation: in-plane shifts between pixels,
// and between the two neighbouring planes. What no plane covers becomes air.
void resample_planes(const PlaneStack& stack, double spacing_mm, const Volume& decoded,
                     const PlaneRange& range, const IndexBox& box, int k, int count, Volume& out) {
  const Eigen::Vector2d first =
      least_px(stack.drift_px) + Eigen::Vector2d(box.first[0], box.first[1]);
  parallel_for(k, k + count, [&](int slice) {
    const Between at = find_between(stack.along_mm, (box.first[2] + slice) * spacing_mm);
    const Eigen::Vector2d below = first - stack.drift_px[at.below];
    const Eigen::Vector2d above = first - stack.drift_px[at.below + 1];
    std::size_t voxel = std::size_t(slice) * box.size[0] * box.size[1];
    for (int j = 0; j < box.size[1]; ++j) {
      for (int i = 0; i < box.size[0]; ++i, ++voxel) {
        const int k_below = at.below - range.first;
        const double a = sample(decoded, k_below, i + below.x(), j + below.y(), kAir_hu);
        const double b = sample(decoded, k_below + 1, i + above.x(), j + above.y(), kAir_hu);
        set_value(out, voxel, (1 - at.share) * a + at.share * b);
      }
    }
  });
}

void resample(const DicomStack& stack, const Volume& scanned, const IndexBox& box, Volume& volume,
              const RunContext& context) {
  volume.voxels.resize(box.voxels());
  const IndexBox whole_slices = {{0, 0, 0}, {scanned.size[0], scanned.size[1], 1}};
  for (int k = 0; k < box.size[2]; k += kSlicesAtATime) {
    const int count = std::min(kSlicesAtATime, box.size[2] - k);
    const PlaneRange range =
        planes_needed(stack.planes, stack.spacing_mm, box.first[2] + k, box.first[2] + k + count);
    Volume decoded;
    decoded.size = {scanned.size[0], scanned.size[1], range.count()};
    decode_slices(std::span(stack.slices)
                      .subspan(static_cast<std::size_t>(range.first),
                               static_cast<std::size_t>(range.count())),
                  whole_slices, decoded, context, volume.is_real());
    if (decoded.is_real()) make_real(volume);
    resample_planes(stack.planes, stack.spacing_mm, decoded, range, box, k, count, volume);
    // Pieces repeat each other's complaints.
    for (const std::string& warning : decoded.warnings) {
      const auto& told = volume.warnings;
      if (std::find(told.begin(), told.end(), warning) == told.end())
        volume.warnings.push_back(warning);
    }
    context.progress(static_cast<double>(k + count) / box.size[2]);
  }
}

DicomStack stack_of(const fs::path& folder, const VolumeReadOptions& options) {
  const DicomFolder found =
      fs::is_directory(folder) ? scan_dicom_folder(folder) : scan_dicom_file_or_directory(folder);
  std::vector<std::string> warnings;
  DicomSeries series = choose_series(found, options.series, warnings);
  if (options.strict) {
    for (const ScannedFile& other : found.others) {
      if (!other.damaged) continue;
      throw BadDataError(other.file,
                         "--strict refuses a folder with damaged files: " + other.reason);
    }
  }
  DicomStack stack = sorted_stack(std::move(series.slices), folder, options);
  stack.warnings.insert(stack.warnings.begin(), warnings.begin(), warnings.end());
  return stack;
}

}  // namespace

Volume read_dicom(const fs::path& folder, const VolumeReadOptions& options,
                  const RunContext& context) {
  if (!fs::is_directory(folder)) {
    const DicomMaskKind kind = dicom_mask_kind(folder);
    if (kind == DicomMaskKind::segmentation) return read_dicom_segmentation(folder, options);
    if (kind == DicomMaskKind::contours) return read_dicom_contours(folder, options);
  }
  const DicomStack stack = stack_of(folder, options);
  const Volume scanned = scanned_grid(stack, folder);
  Volume volume = stack.regular()
                      ? scanned
                      : upright_grid(stack.planes, scanned, stack.spacing_mm, folder.string());
  volume.warnings = stack.warnings;
  volume.time_points = stack.time_points;
  volume.gantry_tilt_degrees = stack.tilt_degrees;
  volume.slices = {stack.slices.front().frame_of_reference_uid, stack.planes.corners_mm,
                   scanned.size[0], scanned.size[1]};
  const IndexBox box = options.region ? voxels_of_region(volume, *options.region, folder.string())
                                      : IndexBox::whole(volume);
  crop_grid(volume, box);
  if (stack.regular()) {
    decode_slices(
        std::span(stack.slices)
            .subspan(static_cast<std::size_t>(box.first[2]), static_cast<std::size_t>(box.size[2])),
        box, volume, context);
  } else {
    resample(stack, scanned, box, volume, context);
  }
  return volume;
}

}  // namespace organbake
