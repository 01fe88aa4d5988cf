// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/dicom_stack.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "core/error.h"
#include "core/text.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// Scanners write positions with two to six decimals; repeated rounding stays below this.
constexpr double kSlack_mm = 0.05;
constexpr double kSlackShare = 0.01;  // of the gap, for thick slices
constexpr double kSamePlace_mm = 1e-3;
// Interpolating across more than this many typical gaps would invent anatomy.
constexpr double kWidestGap = 2.5;
constexpr double kDriftSteps = 1000;  // per pixel
constexpr double kUnitTolerance = 1e-3;

// Slices that can form one volume agree in these, directions to a thousandth.
using SeriesKey = std::tuple<std::string, int, int, std::array<long, 8>>;

SeriesKey key_of(const DicomSlice& slice) {
  std::array<long, 8> rounded;
  for (int i = 0; i < 3; ++i) {
    rounded[i] = std::lround(slice.row_axis[i] * 1e3);
    rounded[3 + i] = std::lround(slice.column_axis[i] * 1e3);
  }
  for (int i = 0; i < 2; ++i) rounded[6 + i] = std::lround(slice.pixel_mm[i] * 1e4);
  return {slice.series_uid, slice.columns, slice.rows, rounded};
}

void check_geometry(const DicomSlice& slice) {
  if (!slice.has_geometry) {
    throw BadDataError(slice.file,
                       "has no ImagePositionPatient, ImageOrientationPatient or "
                       "PixelSpacing: its place in the patient is unknown");
  }
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

std::vector<DicomSlice> only_ct(const DicomFolder& folder, const fs::path& path) {
  std::vector<DicomSlice> ct;
  for (const DicomSlice& slice : folder.slices) {
    if (slice.modality == "CT") ct.push_back(slice);
  }
  if (ct.empty()) {
    throw BadDataError(path, "holds no CT images but modality \"" + folder.slices.front().modality +
                                 "\", whose values are not Hounsfield units");
  }
  return ct;
}

// Slices without geometry (localizers, screen captures) are passed over as long as others have it.
std::vector<DicomSlice> largest_series(std::vector<DicomSlice> ct,
                                       std::vector<std::string>& warnings) {
  std::map<SeriesKey, std::vector<DicomSlice>> series;
  std::size_t without_place = 0;
  for (DicomSlice& slice : ct) {
    if (slice.has_geometry) {
      series[key_of(slice)].push_back(std::move(slice));
    } else {
      ++without_place;
    }
  }
  if (series.empty()) check_geometry(ct.front());
  auto most = series.begin();
  for (auto it = series.begin(); it != series.end(); ++it) {
    if (it->second.size() > most->second.size()) most = it;
  }
  if (without_place > 0) {
    warnings.push_back(std::to_string(without_place) +
                       " CT images without a place in the patient were passed over");
  }
  if (series.size() > 1) {
    const DicomSlice& first = most->second.front();
    warnings.push_back("the folder holds " + std::to_string(series.size()) +
                       " CT series or orientations; the one with most slices was taken: series " +
                       (first.series_number.empty() ? "?" : first.series_number) + " (" +
                       std::to_string(most->second.size()) + " slices, first file " +
                       first.file.filename().string() + ")");
  }
  return std::move(most->second);
}

void sort_along_normal(DicomStack& stack) {
  const Eigen::Vector3d normal = stack.slices.front().normal().normalized();
  std::stable_sort(stack.slices.begin(), stack.slices.end(),
                   [&](const DicomSlice& a, const DicomSlice& b) {
                     return a.position_mm.dot(normal) < b.position_mm.dot(normal);
                   });
  const DicomSlice& first = stack.slices.front();
  for (const DicomSlice& slice : stack.slices) {
    const Eigen::Vector3d offset = slice.position_mm - first.position_mm;
    stack.along_mm.push_back(offset.dot(normal));
    const Eigen::Vector2d drift(offset.dot(first.row_axis) / first.pixel_mm.x(),
                                offset.dot(first.column_axis) / first.pixel_mm.y());
    // Positions are decimal text: whole pixels must stay whole, or borders mix with air.
    stack.drift_px.push_back((drift * kDriftSteps).array().round().matrix() / kDriftSteps);
  }
}

void measure_spacing(DicomStack& stack, const fs::path& path) {
  std::vector<double> gaps;
  for (std::size_t k = 1; k < stack.slices.size(); ++k) {
    gaps.push_back(stack.along_mm[k] - stack.along_mm[k - 1]);
    if (gaps.back() < kSamePlace_mm) {
      throw BadDataError(stack.slices[k].file,
                         "lies in the same place as " +
                             stack.slices[k - 1].file.filename().string() +
                             ": the series holds more than one volume (time points or copies)");
    }
  }
  std::vector<double> sorted = gaps;
  std::sort(sorted.begin(), sorted.end());
  const double median = sorted[sorted.size() / 2];
  const double mean = stack.along_mm.back() / static_cast<double>(gaps.size());
  const double slack = std::max(kSlack_mm, kSlackShare * median);
  for (std::size_t k = 0; k < gaps.size(); ++k) {
    if (gaps[k] > kWidestGap * median) {
      throw BadDataError(path, "slices are missing: " + to_text(gaps[k], 2) + " mm between " +
                                   stack.slices[k].file.filename().string() + " and " +
                                   stack.slices[k + 1].file.filename().string() + ", where " +
                                   to_text(median, 2) + " mm is usual");
    }
    const double strayed = stack.along_mm[k + 1] - mean * static_cast<double>(k + 1);
    if (std::abs(gaps[k] - mean) > slack || std::abs(strayed) > slack) stack.even = false;
  }
  stack.spacing_mm = stack.even ? mean : median;
  if (!stack.even) {
    stack.warnings.push_back("the slices are unevenly spaced (" + to_text(sorted.front(), 2) + "…" +
                             to_text(sorted.back(), 2) + " mm); they were interpolated to " +
                             to_text(stack.spacing_mm, 2) + " mm");
  }
}

void measure_tilt(DicomStack& stack) {
  const Eigen::Vector2d pixel_mm = stack.slices.front().pixel_mm;
  double largest = 0, angle = 0;
  for (std::size_t k = 1; k < stack.slices.size(); ++k) {
    const double drift = stack.drift_px[k].cwiseProduct(pixel_mm).norm();
    if (drift <= largest) continue;
    largest = drift;
    angle = std::atan2(drift, stack.along_mm[k]) * 180 / M_PI;
  }
  if (largest <= std::max(kSlack_mm, 0.1 * pixel_mm.minCoeff())) return;
  stack.tilt_degrees = angle;
  stack.warnings.push_back("the gantry was tilted by " + to_text(angle, 1) +
                           "°; the slices were shifted back into an upright grid");
}

}  // namespace

DicomStack choose_stack(DicomFolder folder, const fs::path& path) {
  DicomStack stack;
  stack.slices = largest_series(only_ct(folder, path), stack.warnings);
  if (folder.unreadable > 0) {
    stack.warnings.push_back(std::to_string(folder.unreadable) +
                             " DICOM files could not be read; " + folder.first_error);
  }
  for (const DicomSlice& slice : stack.slices) check_geometry(slice);
  if (stack.slices.size() < 2) {
    throw BadDataError(stack.slices.front().file,
                       stack.slices.front().frames > 1
                           ? "is a multi-frame CT, which is not read; export single-frame slices"
                           : "is the only CT slice of its series; a volume needs at least two");
  }
  sort_along_normal(stack);
  measure_spacing(stack, path);
  measure_tilt(stack);
  return stack;
}

}  // namespace organbake
