// SPDX-License-Identifier: GPL-3.0-or-later
// Slices of one series in the order of their places (PS3.3, C.7.6.2): copies go, of several volumes
// of the same places one is chosen, and gaps and tilt are measured.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>

#include "dicom/dicom.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

bool same_place(const DicomSlice& a, const DicomSlice& b) {
  return std::abs((a.position_mm - b.position_mm).dot(a.normal().normalized())) < kSamePlace_mm;
}

bool has_copies(const std::vector<DicomSlice>& sorted) {
  return std::adjacent_find(sorted.begin(), sorted.end(), same_place) != sorted.end();
}

std::string stored_pixels(const DicomSlice& slice) {
  std::ifstream file(slice.file, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(slice.pixels.offset));
  if (slice.pixels.bytes == DicomPixels::kEncapsulated) {
    // Frames of one file are not looked for in it: they count as different.
    return std::to_string(slice.frame) + std::string(std::istreambuf_iterator<char>(file), {});
  }
  std::string bytes(slice.pixels.bytes, '\0');
  if (slice.pixels.frames > 1) {
    bytes.resize(slice.stored_bytes());
    file.seekg(static_cast<std::streamoff>(slice.pixels.offset) +
               static_cast<std::streamoff>(slice.stored_bytes()) * slice.frame);
  }
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

bool same_pixels(const DicomSlice& a, const DicomSlice& b) {
  constexpr double kSameGrid_mm = 1e-3;
  return a.slope == b.slope && a.intercept == b.intercept &&
         a.pixels.bits_stored == b.pixels.bits_stored &&
         a.pixels.transfer_syntax == b.pixels.transfer_syntax &&
         (a.position_mm - b.position_mm).norm() < kSameGrid_mm &&
         stored_pixels(a) == stored_pixels(b);
}

// One of several volumes of the same places.
struct SameVolume {
  std::string value;  // of what tells it apart: "3", "B30f"
  std::vector<DicomSlice> slices;
};
struct SameVolumes {
  std::string what;  // "temporal position"
  std::vector<SameVolume> volumes;
};

// Parted by the first property that explains why places are taken twice.
SameVolumes parted(const std::vector<DicomSlice>& sorted) {
  for (const auto& [what, ignored] : sorted.front().told_apart_by) {
    std::vector<std::string> values;
    for (const DicomSlice& slice : sorted) values.push_back(slice.told_by(what));
    SameVolumes found{what, {}};
    for (const SameValue& part : parted_by(values)) {
      SameVolume& volume = found.volumes.emplace_back(part.value);
      for (const std::size_t i : part.members) volume.slices.push_back(sorted[i]);
    }
    const bool explains =
        found.volumes.size() > 1 &&
        std::all_of(found.volumes.begin(), found.volumes.end(), [](const SameVolume& volume) {
          return volume.slices.size() > 1 && !has_copies(volume.slices);
        });
    if (explains) return found;
  }
  return {};
}

std::string listed(const SameVolumes& same) {
  std::string text;
  for (std::size_t i = 0; i < same.volumes.size(); ++i) {
    const SameVolume& volume = same.volumes[i];
    text += (i ? "; " : "") + std::to_string(i + 1) + ": " + same.what + " " + volume.value + ", " +
            std::to_string(volume.slices.size()) + " slices";
  }
  return text;
}

// The copies gone, if all that lies in one place is the same; else nothing.
std::vector<DicomSlice> same_slices_once(const std::vector<DicomSlice>& sorted,
                                         std::vector<fs::path>& copies, fs::path& differs) {
  std::vector<DicomSlice> kept;
  for (const DicomSlice& slice : sorted) {
    if (kept.empty() || !same_place(kept.back(), slice)) {
      kept.push_back(slice);
    } else if (same_pixels(kept.back(), slice)) {
      copies.push_back(slice.file);
    } else {
      differs = slice.file;
      return {};
    }
  }
  return kept;
}

SeriesPart chosen_part(const SameVolumes& same, const fs::path& folder,
                       const VolumeReadOptions& options) {
  SeriesPart part;
  part.time_points = static_cast<std::int64_t>(same.volumes.size());
  const auto by_size = [](const SameVolume& a, const SameVolume& b) {
    return a.slices.size() < b.slices.size();
  };
  const auto [least, most] = std::minmax_element(same.volumes.begin(), same.volumes.end(), by_size);
  const bool clear = same.what == "acquisition" && least->slices.size() < most->slices.size();
  if (options.time == 0 && clear) {
    part.slices = most->slices;
    part.warnings.push_back(
        "the series holds several acquisitions of the same places; acquisition " + most->value +
        " was taken, the one with most slices (" + listed(same) + "); --time chooses another");
    return part;
  }
  if (options.time > part.time_points)
    throw UsageError(folder.string() + ": the series holds " + std::to_string(part.time_points) +
                     " volumes of the same places, no --time " + std::to_string(options.time) +
                     " (" + listed(same) + ")");
  if (options.time == 0 && !options.any_time)
    throw BadDataError(folder, "the series holds " + std::to_string(part.time_points) +
                                   " volumes of the same places (" + listed(same) +
                                   "); choose one with --time 1…" +
                                   std::to_string(part.time_points));
  const auto index = static_cast<std::size_t>(std::max(options.time, 1) - 1);
  part.slices = same.volumes[index].slices;
  part.warnings.push_back("the series holds " + std::to_string(part.time_points) +
                          " volumes of the same places; number " + std::to_string(index + 1) +
                          " was taken (" + listed(same) + ")");
  return part;
}

}  // namespace

std::vector<SameValue> parted_by(const std::vector<std::string>& values) {
  const auto number = [](const std::string& text) {
    double value = 0;
    return read_number(text, value) == text.size() && !text.empty() ? value : HUGE_VAL;
  };
  std::map<std::pair<double, std::string>, std::vector<std::size_t>> parts;
  for (std::size_t i = 0; i < values.size(); ++i)
    parts[{number(values[i]), values[i]}].push_back(i);
  std::vector<SameValue> all;
  for (auto& [key, members] : parts) all.push_back({key.second, std::move(members)});
  return all;
}

namespace {

// Leaves one slice for every place along the normal, by which the slices are sorted: copies (the
// same stored pixels) go. Where the same places were taken several times, at several times of the
// heart's or the breath's cycle, in several acquisitions or reconstructions, options.time says
// which volume is taken; without it, of acquisitions of different size the one with most slices is,
// with a warning, and otherwise the volumes are listed in an error. Throws BadDataError also when
// all slices lie in one place, or when two that differ lie in the same place and nothing tells them
// apart.
SeriesPart without_copies(std::vector<DicomSlice> sorted, const fs::path& folder,
                          const VolumeReadOptions& options) {
  if (!has_copies(sorted)) {
    if (options.time > 1 && !options.lasting)
      throw UsageError(folder.string() + ": the series holds one volume, no --time " +
                       std::to_string(options.time));
    return {std::move(sorted), 1, {}};
  }
  if (same_place(sorted.front(), sorted.back()))
    throw BadDataError(folder, "all " + std::to_string(sorted.size()) +
                                   " slices lie in one place; they form no volume");
  SeriesPart part;
  std::vector<fs::path> copies;
  fs::path differs;
  part.slices = same_slices_once(sorted, copies, differs);
  if (differs.empty()) {
    part.warnings.push_back(std::to_string(copies.size()) + " copies of slices were passed over (" +
                            named_files(copies) + ")");
    return part;
  }
  const SameVolumes same = parted(sorted);
  if (same.volumes.empty())
    throw BadDataError(differs,
                       "lies in the same place as another slice and differs from it: the "
                       "series holds more than one volume, and nothing in the headers "
                       "tells them apart; give a folder of one");
  return chosen_part(same, folder, options);
}

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
      std::abs(slice.column_axis.norm() - 1) > kUnitTolerance || skew > kUnitTolerance)
    throw BadDataError(slice.file, "ImageOrientationPatient is not a pair of perpendicular units");
  if (!(slice.pixel_mm.minCoeff() > 0))
    throw BadDataError(slice.file, "PixelSpacing is not positive");
  if (!std::isfinite(slice.slope) || !std::isfinite(slice.intercept) || slice.slope == 0)
    throw BadDataError(slice.file, "RescaleSlope or RescaleIntercept is not a usable number");
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
  for (std::size_t k = 1; k < stack.slices.size(); ++k)
    sorted.push_back(stack.planes.along_mm[k] - stack.planes.along_mm[k - 1]);
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
  if (options.strict && !stack.warnings.empty())
    throw BadDataError(folder, "--strict refuses to mend it: " + stack.warnings.front());
  measure_tilt(stack);
  return stack;
}

}  // namespace organbake
