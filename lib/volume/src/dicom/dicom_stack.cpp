// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/dicom_stack.h"

#include <algorithm>
#include <cmath>

#include "dicom/dicom_copies.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// Scanners write positions with two to six decimals; repeated rounding stays below this.
constexpr double kSlack_mm = 0.05;
constexpr double kSlackShare = 0.01;  // of the gap, for thick slices
// Interpolating across more than this many typical gaps would invent anatomy.
constexpr double kWidestSliceGap = 2.5;
// A gap this near to a whole number of usual ones is a slice that is not there.
constexpr double kMissingSlack = 0.05;
constexpr double kSteepestCourse = 1.0;  // tan 45°; gantries tilt by 30° at most
constexpr double kUnitTolerance = 1e-3;

void check_geometry(const DicomSlice& slice) {
  const double skew = std::abs(slice.row_axis.dot(slice.column_axis));
  if (std::abs(slice.row_axis.norm() - 1) > kUnitTolerance ||
      std::abs(slice.column_axis.norm() - 1) > kUnitTolerance || skew > kUnitTolerance) {
    throw BadDataError(slice.file, "ImageOrientationPatient is not a pair of perpendicular units");
  }
  if (!(slice.pixel_mm.minCoeff() > 0))
    throw BadDataError(slice.file, "PixelSpacing is not positive");
  if (!std::isfinite(slice.slope) || !std::isfinite(slice.intercept) || slice.slope == 0) {
    throw BadDataError(slice.file, "RescaleSlope or RescaleIntercept is not a usable number");
  }
}

void sort_along_normal(std::vector<DicomSlice>& slices) {
  const Eigen::Vector3d normal = slices.front().normal().normalized();
  std::stable_sort(slices.begin(), slices.end(), [&](const DicomSlice& a, const DicomSlice& b) {
    return a.position_mm.dot(normal) < b.position_mm.dot(normal);
  });
}

void measure_places(DicomStack& stack) {
  const DicomSlice& first = stack.slices.front();
  std::vector<Eigen::Vector3d> corners;
  for (const DicomSlice& slice : stack.slices) corners.push_back(slice.position_mm);
  stack.planes = PlaneStack(first.plane_axes(), first.pixel_mm, std::move(corners));
}

// "1 slice between a.dcm and b.dcm", for every gap of about a whole number of usual gaps.
std::string missing_slices(const DicomStack& stack, double usual_mm) {
  std::string places;
  for (std::size_t k = 1; k < stack.slices.size(); ++k) {
    const double gaps = (stack.planes.along_mm[k] - stack.planes.along_mm[k - 1]) / usual_mm;
    const long whole = std::lround(gaps);
    if (whole < 2 || std::abs(gaps - static_cast<double>(whole)) > kMissingSlack) continue;
    places += (places.empty() ? "" : ", ") + std::to_string(whole - 1) + " between " +
              stack.slices[k - 1].file.filename().string() + " and " +
              stack.slices[k].file.filename().string();
  }
  return places;
}

void check_gaps(const DicomStack& stack, double usual_mm, const fs::path& folder) {
  for (std::size_t k = 1; k < stack.slices.size(); ++k) {
    const double gap = stack.planes.along_mm[k] - stack.planes.along_mm[k - 1];
    if (gap <= kWidestSliceGap * usual_mm) continue;
    throw BadDataError(folder, "slices are missing: " + to_text(gap, 2) + " mm between " +
                                   stack.slices[k - 1].file.filename().string() + " and " +
                                   stack.slices[k].file.filename().string() + ", where " +
                                   to_text(usual_mm, 2) + " mm is usual");
  }
}

// "13 × 4.00, 13 × 7.00": gaps that differ by less than the positions' own rounding are one.
std::string gap_table(const std::vector<double>& sorted) {
  constexpr std::size_t kMostRows = 8;
  std::string table;
  std::size_t rows = 0;
  for (std::size_t first = 0; first < sorted.size(); ++rows) {
    std::size_t end = first;
    while (end < sorted.size() && sorted[end] - sorted[first] < kSlack_mm) ++end;
    if (rows == kMostRows) return table + ", …";
    table += (rows ? ", " : "") + std::to_string(end - first) + " × " +
             to_text(sorted[first + (end - first) / 2], 2);
    first = end;
  }
  return table;
}

void measure_spacing(DicomStack& stack, const fs::path& folder) {
  std::vector<double> sorted;
  for (std::size_t k = 1; k < stack.slices.size(); ++k) {
    sorted.push_back(stack.planes.along_mm[k] - stack.planes.along_mm[k - 1]);
  }
  const double mean = stack.planes.along_mm.back() / static_cast<double>(sorted.size());
  const std::vector<double> gaps = sorted;
  std::sort(sorted.begin(), sorted.end());
  const double median = sorted[sorted.size() / 2];
  check_gaps(stack, median, folder);
  const double slack = std::max(kSlack_mm, kSlackShare * median);
  for (std::size_t k = 0; k < gaps.size(); ++k) {
    const double strayed = stack.planes.along_mm[k + 1] - mean * static_cast<double>(k + 1);
    if (std::abs(gaps[k] - mean) > slack || std::abs(strayed) > slack) stack.even = false;
  }
  stack.spacing_mm = stack.even ? mean : median;
  if (stack.even) return;
  const std::string missing = missing_slices(stack, median);
  if (!missing.empty()) stack.warnings.push_back("slices are missing: " + missing);
  stack.warnings.push_back("the slices are unevenly spaced (" + to_text(sorted.front(), 2) + "…" +
                           to_text(sorted.back(), 2) + " mm: " + gap_table(sorted) +
                           "); they were interpolated to " + to_text(stack.spacing_mm, 2) + " mm");
}

// One wrong digit in a position puts a slice beside the others, and the grid that holds them all
// would have room for little else.
void check_course(const DicomStack& stack) {
  const Eigen::Vector2d pixel_mm = stack.slices.front().pixel_mm;
  for (std::size_t k = 1; k < stack.slices.size(); ++k) {
    const double beside = stack.planes.drift_px[k].cwiseProduct(pixel_mm).norm();
    if (beside <= stack.planes.along_mm[k] * kSteepestCourse + pixel_mm.maxCoeff()) continue;
    throw BadDataError(stack.slices[k].file, "lies " + to_text(beside, 1) + " mm beside and " +
                                                 to_text(stack.planes.along_mm[k], 1) +
                                                 " mm behind the first slice; no gantry tilts so "
                                                 "far, the position is wrong");
  }
}

void measure_tilt(DicomStack& stack) {
  const Eigen::Vector2d pixel_mm = stack.slices.front().pixel_mm;
  double largest = 0, angle = 0;
  for (std::size_t k = 1; k < stack.slices.size(); ++k) {
    const double drift = stack.planes.drift_px[k].cwiseProduct(pixel_mm).norm();
    if (drift <= largest) continue;
    largest = drift;
    angle = std::atan2(drift, stack.planes.along_mm[k]) * 180 / M_PI;
  }
  if (largest <= std::max(kSlack_mm, 0.1 * pixel_mm.minCoeff())) return;
  stack.tilt_degrees = angle;
  stack.warnings.push_back("the gantry was tilted by " + to_text(angle, 1) +
                           "°; the slices were shifted back into an upright grid");
}

}  // namespace

DicomStack sorted_stack(std::vector<DicomSlice> slices, const fs::path& folder,
                        const VolumeReadOptions& options) {
  for (const DicomSlice& slice : slices) check_geometry(slice);
  DicomStack stack;
  sort_along_normal(slices);
  SeriesPart part = without_copies(std::move(slices), folder, options);
  stack.slices = std::move(part.slices);
  stack.time_points = part.time_points;
  stack.warnings = std::move(part.warnings);
  measure_places(stack);
  check_course(stack);
  measure_spacing(stack, folder);
  if (options.strict && !stack.warnings.empty()) {
    throw BadDataError(folder, "--strict refuses to mend it: " + stack.warnings.front());
  }
  measure_tilt(stack);
  return stack;
}

}  // namespace organbake
