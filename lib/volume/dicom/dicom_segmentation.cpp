// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a DICOM segmentation (PS3.3, A.51 and C.8.20) as a mask. Where each frame lies its own
// functional groups say (C.7.6.16); frames without anything in them are often left out, so that
// how thick the others are is asked of the scan.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "dicom/dicom.h"
#include "dicom/dicom_document.h"
#include "files/volume_files.h"
#include "grid/grids.h"
#include "organbake/core/error.h"
#include "organbake/volume/volume.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBigEndian = "1.2.840.10008.1.2.2";
constexpr double kSameFramePlane_mm = 0.01;

struct SegmentFrame {
  int segment = 0;  // 0 = a label map, whose values are the segments
  DicomSlice slice;
  PlacedPlanes::Place place = {};
};

struct Segmentation {
  std::string kind;  // BINARY, FRACTIONAL, LABELMAP
  int bits = 1;
  double half = 0.5;  // of a fractional one's largest value
  int columns = 0, rows = 0, stored_frames = 0;
  Volume grid;
  std::vector<SegmentFrame> frames;
  std::vector<std::byte> pixels;
};

// Segments may overlap, so each is a layer; those of a label map do not, and its 0 is the ground
// that some programs list, too.
std::vector<LabelName> segment_names(const DicomDocument& document, bool label_map) {
  std::vector<LabelName> names;
  const vtkDICOMValue& segments = document.data().Get(DC::SegmentSequence);
  for (std::size_t i = 0; i < segments.GetNumberOfValues(); ++i) {
    const vtkDICOMItem& item = segments.GetItem(i);
    const int number = item.Get(DC::SegmentNumber).AsInt();
    std::string name = dicom_text(item.Get(DC::SegmentLabel));
    if (name.empty()) name = "segment " + std::to_string(number);
    if (label_map && number == 0) continue;
    names.push_back({number, name, label_map ? 0 : static_cast<int>(i)});
  }
  return names;
}

// A grid has one direction and one size of pixels.
void check_alike(const DicomSlice& first, const DicomSlice& other, const fs::path& file) {
  constexpr double kSameAxis = 1e-3, kSamePixel = 1e-3;
  const std::string where = "frame " + std::to_string(other.frame + 1);
  const double turned = std::max((first.row_axis - other.row_axis).norm(),
                                 (first.column_axis - other.column_axis).norm());
  const double other_size =
      ((other.pixel_mm - first.pixel_mm).cwiseQuotient(first.pixel_mm)).cwiseAbs().maxCoeff();
  if (turned <= kSameAxis && other_size <= kSamePixel) return;
  throw BadDataError(file, where + " has another " +
                               (turned > kSameAxis ? "orientation" : "pixel spacing") +
                               " than the first; save the segmentation on one grid");
}

void read_frames(const DicomDocument& document, Segmentation& seg, const fs::path& file) {
  vtkDICOMMetaData& data = document.data();
  const int count = std::max(1, data.Get(DC::NumberOfFrames).AsInt());
  constexpr std::uintmax_t kLeastFrame = 8;  // bytes of its place, if it had no pixels
  if (static_cast<std::uintmax_t>(count) > fs::file_size(document.readable()) / kLeastFrame)
    throw BadDataError(file, "truncated: it cannot hold " + std::to_string(count) + " frames");
  for (int frame = 0; frame < count; ++frame) {
    SegmentFrame& read = seg.frames.emplace_back();
    read_frame(data, frame, read.slice);
    if (!read.slice.has_geometry)
      throw BadDataError(file, "frame " + std::to_string(frame + 1) +
                                   " does not say its position, orientation or pixel spacing; "
                                   "save the segmentation as a volume (.nii.gz, .nrrd)");
    if (!(read.slice.pixel_mm.minCoeff() > 0))
      throw BadDataError(file, "its pixel spacing is not positive");
    check_alike(seg.frames.front().slice, read.slice, file);
    if (seg.kind != "LABELMAP")
      read.segment = data.Get(0, frame, DC::ReferencedSegmentNumber).AsInt();
  }
}

std::vector<std::size_t> all_of(const std::vector<SegmentFrame>& frames) {
  std::vector<std::size_t> all(frames.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

// Whether a segment has two frames with one corner.
bool has_copies(const std::vector<SegmentFrame>& frames, const std::vector<std::size_t>& among) {
  std::set<std::array<long, 4>> corners;
  for (const std::size_t i : among) {
    std::array<long, 4> corner = {frames[i].segment, 0, 0, 0};
    for (int axis = 0; axis < 3; ++axis)
      corner[axis + 1] = std::lround(frames[i].slice.position_mm[axis] / kSameFramePlane_mm);
    if (!corners.insert(corner).second) return true;
  }
  return false;
}

// Frames of several phases of the heart or the breath, by what tells them apart; a time of day does
// only where it explains why one place is taken twice.
std::vector<SameValue> phases_of(const std::vector<SegmentFrame>& frames, std::string& what) {
  const std::vector<std::size_t> all = all_of(frames);
  for (const char* name :
       {"temporal position", "phase of the cycle, %", "trigger time, ms", "acquisition time"}) {
    what = name;
    std::vector<std::string> values;
    for (const SegmentFrame& frame : frames) values.push_back(frame.slice.told_by(what));
    std::vector<SameValue> phases = parted_by(values);
    const bool explains = what != "acquisition time" ||
                          (has_copies(frames, all) &&
                           std::none_of(phases.begin(), phases.end(), [&](const SameValue& part) {
                             return has_copies(frames, part.members);
                           }));
    if (phases.size() > 1 && explains) return phases;
  }
  return {};
}

// Leaves the frames of the phase that is asked for.
void choose_phase(Segmentation& seg, const VolumeReadOptions& options, const fs::path& file) {
  std::string what;
  const std::vector<SameValue> phases = phases_of(seg.frames, what);
  if (phases.empty()) return;
  std::string list;
  for (std::size_t i = 0; i < phases.size(); ++i)
    list += (i ? "; " : "") + std::to_string(i + 1) + ": " + what + " " +
            (phases[i].value.empty() ? "not told" : phases[i].value) + ", " +
            std::to_string(phases[i].members.size()) + " frames";
  const auto count = static_cast<std::int64_t>(phases.size());
  const std::int64_t chosen = chosen_time({count, list}, options, file.string());
  std::vector<SegmentFrame> frames;
  for (const std::size_t i : phases[static_cast<std::size_t>(chosen)].members)
    frames.push_back(std::move(seg.frames[i]));
  seg.frames = std::move(frames);
  seg.grid.time_points = count;
  if (options.time == 0)
    seg.grid.warnings.push_back("it holds " + std::to_string(count) + " time points (" + list +
                                "); number 1 was taken");
}

GapClues clues_of(const DicomDocument& document, const VolumeReadOptions& options) {
  vtkDICOMMetaData& data = document.data();
  GapClues clues{.scan = options.scan};
  const auto positive = [&](vtkDICOMTag tag) {
    const vtkDICOMValue& value = data.Get(0, 0, tag);
    const double mm = value.IsValid() ? value.AsDouble() : 0;
    return std::isfinite(mm) && mm > 0 ? mm : 0;
  };
  clues.told_mm = positive(DC::SpacingBetweenSlices);
  clues.thickness_mm = positive(DC::SliceThickness);
  return clues;
}

void place_frames(const DicomDocument& document, const VolumeReadOptions& options,
                  Segmentation& seg, const fs::path& file) {
  const DicomSlice& first = seg.frames.front().slice;
  const Eigen::Matrix3d axes = first.plane_axes();
  if (has_copies(seg.frames, all_of(seg.frames)))
    seg.grid.warnings.push_back(
        "it has several frames of one segment in one place, and nothing "
        "tells them apart; they were united");
  std::vector<Eigen::Vector3d> corners;
  std::vector<double> along, places;
  for (const SegmentFrame& frame : seg.frames) {
    corners.push_back(frame.slice.position_mm);
    along.push_back(corners.back().dot(axes.col(2)));
  }
  std::vector<double> sorted = along;
  std::sort(sorted.begin(), sorted.end());
  for (const double place : sorted)
    if (places.empty() || place - places.back() > kSameFramePlane_mm) places.push_back(place);
  const std::vector<Slab> slabs =
      slabs_of(places, axes.col(2), clues_of(document, options), file.string(), seg.grid.warnings);
  std::vector<Slab> of_frames;
  for (const double place : along) {
    const auto above = std::upper_bound(places.begin(), places.end(), place);
    of_frames.push_back(slabs[static_cast<std::size_t>(above - places.begin() - 1)]);
  }
  PlacedPlanes planes = placed({axes, first.pixel_mm, std::move(corners)}, of_frames, seg.columns,
                               seg.rows, file.string());
  for (std::size_t i = 0; i < seg.frames.size(); ++i) seg.frames[i].place = planes.places[i];
  planes.grid.time_points = seg.grid.time_points;
  planes.grid.warnings = std::move(seg.grid.warnings);
  planes.grid.label_names = std::move(seg.grid.label_names);
  seg.grid = std::move(planes.grid);
}

// Frames that were compressed one by one, without loss.
void read_compressed(const DicomDocument& document, const std::string& syntax, DicomCoding coding,
                     Segmentation& seg, const fs::path& file) {
  if (seg.bits == 1)
    throw BadDataError(file, "is a segmentation of single bits in transfer syntax \"" + syntax +
                                 "\", which has none; save it uncompressed");
  DicomSlice slice;
  slice.file = document.readable();
  slice.columns = seg.columns;
  slice.rows = seg.rows;
  slice.pixels.transfer_syntax = syntax;
  slice.pixels.bits_allocated = slice.pixels.bits_stored = seg.bits;
  slice.pixels.frames = seg.stored_frames;
  slice.pixels.present = true;
  slice.pixels.offset = document.pixel_offset();
  slice.pixels.bytes = DicomPixels::kEncapsulated;
  for (; slice.frame < slice.pixels.frames; ++slice.frame) {
    const std::vector<std::byte> frame = decompress(slice, coding);
    seg.pixels.insert(seg.pixels.end(), frame.begin(), frame.end());
  }
}

void read_pixels(const DicomDocument& document, Segmentation& seg, const fs::path& file) {
  const std::string syntax = document.text(DC::TransferSyntaxUID);
  const DicomCoding coding = coding_of(syntax);
  if (coding == DicomCoding::unknown || coding == DicomCoding::lossy_jpeg || syntax == kBigEndian)
    throw BadDataError(file, "is a segmentation in transfer syntax \"" + syntax +
                                 "\", which is not read; save it uncompressed");
  if (coding != DicomCoding::native) return read_compressed(document, syntax, coding, seg, file);
  const std::uint64_t values = static_cast<std::uint64_t>(seg.columns) *
                               static_cast<std::uint64_t>(seg.rows) *
                               static_cast<std::uint64_t>(seg.stored_frames);
  const std::uint64_t bytes = (values * static_cast<std::uint64_t>(seg.bits) + 7) / 8;
  if (bytes > document.pixel_bytes())
    throw BadDataError(
        file, "truncated: it cannot hold " + std::to_string(seg.stored_frames) + " frames");
  seg.pixels.resize(static_cast<std::size_t>(bytes));
  ByteStream(document.readable(), ByteStream::Coding::raw, document.pixel_offset())
      .read_exactly(seg.pixels);
}

// The stored value number i, counted over all frames: single bits are packed across them.
int stored_value(const Segmentation& seg, std::size_t i) {
  if (seg.bits == 1) return std::to_integer<int>(seg.pixels[i / 8] >> (i % 8) & std::byte{1});
  if (seg.bits == 8) return std::to_integer<int>(seg.pixels[i]);
  return std::to_integer<int>(seg.pixels[2 * i]) | std::to_integer<int>(seg.pixels[2 * i + 1]) << 8;
}

// Most rows of a mask have nothing.
bool is_empty_row(const Segmentation& seg, std::size_t first) {
  const auto bits = static_cast<std::size_t>(seg.bits), columns = std::size_t(seg.columns);
  const auto begin = seg.pixels.begin() + static_cast<std::ptrdiff_t>(first * bits / 8);
  const auto end =
      seg.pixels.begin() + static_cast<std::ptrdiff_t>(((first + columns) * bits + 7) / 8);
  return std::all_of(begin, end, [](std::byte byte) { return byte == std::byte{0}; });
}

// Frames that are of the segment, or all frames of a label map with all its labels.
Volume one_layer(const Segmentation& seg, int number) {
  const bool label_map = seg.kind == "LABELMAP";
  Volume volume = seg.grid;
  const auto columns = static_cast<std::size_t>(seg.columns);
  const std::size_t row_size = volume.size[0], slice_size = row_size * volume.size[1];
  volume.voxels.assign(slice_size * volume.size[2], 0);
  const bool wide = label_map ? seg.bits == 16 : number > std::numeric_limits<std::int16_t>::max();
  if (wide) make_real(volume);
  for (const SegmentFrame& frame : seg.frames) {
    if (frame.segment != 0 && frame.segment != number) continue;
    const PlacedPlanes::Place& place = frame.place;
    for (int row = 0; row < seg.rows; ++row) {
      const std::size_t from = (std::size_t(frame.slice.frame) * seg.rows + row) * columns;
      if (is_empty_row(seg, from)) continue;
      const std::size_t to = std::size_t(place.row + row) * row_size + std::size_t(place.column);
      for (std::size_t i = 0; i < columns; ++i) {
        const int value = stored_value(seg, from + i);
        if (label_map ? value == 0 : value < seg.half) continue;
        for (int slice = place.slice; slice < place.slice_end; ++slice)
          set_value(volume, slice_size * slice + to + i, label_map ? value : number);
      }
    }
  }
  return volume;
}

Segmentation read_segmentation(const fs::path& file, const VolumeReadOptions& options) {
  const DicomDocument document(file);
  document.check();
  Segmentation seg;
  seg.kind = document.text(DC::SegmentationType);
  if (seg.kind.empty()) seg.kind = "BINARY";
  vtkDICOMMetaData& data = document.data();
  seg.bits = data.Get(DC::BitsAllocated).AsInt();
  if (seg.bits != 1 && seg.bits != 8 && seg.bits != 16)
    throw BadDataError(
        file, "is a segmentation of " + std::to_string(seg.bits) + " bits; 1, 8 or 16 are needed");
  if (seg.kind == "FRACTIONAL") seg.half = data.Get(DC::MaximumFractionalValue).AsInt() / 2.0;
  seg.columns = data.Get(DC::Columns).AsInt();
  seg.rows = data.Get(DC::Rows).AsInt();
  checked_voxel_count({seg.columns, seg.rows, 1}, file.string());
  read_frames(document, seg, file);
  seg.stored_frames = static_cast<int>(seg.frames.size());
  choose_phase(seg, options, file);
  place_frames(document, options, seg, file);
  read_pixels(document, seg, file);
  seg.grid.label_names = segment_names(document, seg.kind == "LABELMAP");
  if (seg.grid.label_names.empty()) throw BadDataError(file, "names no segment");
  warn_of_other_space(document.text(DC::FrameOfReferenceUID), options, seg.grid.warnings);
  return seg;
}

}  // namespace

void warn_of_other_space(const std::string& frame_of_reference_uid,
                         const VolumeReadOptions& options, std::vector<std::string>& warnings) {
  if (!options.scan || frame_of_reference_uid.empty()) return;
  const std::string& scan = options.scan->slices.frame_of_reference_uid;
  if (scan.empty() || scan == frame_of_reference_uid) return;
  warnings.push_back("it may not belong to this CT: it names another frame of reference (" +
                     frame_of_reference_uid + ") than the CT (" + scan +
                     "), so nothing says that they share one space; check where it lies");
}

Volume read_dicom_segmentation(const fs::path& file, const VolumeReadOptions& options) {
  const Segmentation seg = read_segmentation(file, options);
  const std::vector<LabelName>& names = seg.grid.label_names;
  const std::size_t layers = seg.kind == "LABELMAP" ? 1 : names.size();
  Volume mask = read_layers(
      static_cast<std::int64_t>(layers), options, file.string(), names,
      [&](std::int64_t i) { return one_layer(seg, names[static_cast<std::size_t>(i)].label); });
  mask.ends_with_label = !options.region;
  return within_region(std::move(mask), options, file.string());
}

}  // namespace organbake
