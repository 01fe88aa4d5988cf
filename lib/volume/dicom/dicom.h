// SPDX-License-Identifier: GPL-3.0-or-later
// The room of DICOM, in the order of reading: slices of files, folders and series, decoded pixels,
// a stack of slices, and masks (segmentations and contours).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "files/volume_files.h"
#include "grid/grids.h"
#include "organbake/core/run_context.h"
#include "organbake/volume/read_volume.h"
#include "organbake/volume/volume.h"

namespace organbake {

// How and where a DICOM image stores its pixels.
struct DicomPixels {
  static constexpr std::uint32_t kEncapsulated = 0xFFFFFFFF;

  std::string transfer_syntax;
  std::string photometric;
  int bits_allocated = 16, bits_stored = 16;
  bool is_signed = false;
  int samples = 1, frames = 1;
  bool present = false;      // the file has pixel data
  std::uint64_t offset = 0;  // of their first byte in the file
  std::uint32_t bytes = 0;   // kEncapsulated when they are compressed
  struct Padding {
    int first, last;  // stored values that mean "not measured"
  };
  std::optional<Padding> padding;
  bool big_endian = false;
};

// What the header of one DICOM image, or of one frame of several, says, as far as a CT volume needs
// it.
struct DicomSlice {
  std::filesystem::path file;
  int frame = 0;  // of pixels.frames, from 0
  std::string series_uid, series_number, series_description;
  std::string frame_of_reference_uid;  // of the space that the places are in
  std::string modality;
  bool is_localizer = false;
  int columns = 0, rows = 0;
  bool has_geometry = false;  // ImagePositionPatient, ImageOrientationPatient and PixelSpacing
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  // centre of the first pixel, LPS
  Eigen::Vector3d row_axis = Eigen::Vector3d::UnitX();    // along which the column index grows
  Eigen::Vector3d column_axis = Eigen::Vector3d::UnitY();
  Eigen::Vector2d pixel_mm = Eigen::Vector2d::Ones();  // along row_axis, along column_axis
  double slope = 1, intercept = 0;
  // What may tell several volumes of the same places apart, the most telling first:
  // {"temporal position", "3"}. Only what the header has.
  std::vector<std::pair<std::string, std::string>> told_apart_by;
  DicomPixels pixels;

  // The value of one of these; empty where the header has none.
  std::string told_by(const std::string& what) const {
    for (const auto& [name, value] : told_apart_by)
      if (name == what) return value;
    return {};
  }
  // What the stored values of the slice take, uncompressed.
  std::size_t stored_bytes() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) *
           static_cast<std::size_t>(pixels.bits_allocated / 8);
  }
  Eigen::Vector3d normal() const { return row_axis.cross(column_axis); }
  // Columns: along a row, along a column, the unit normal.
  Eigen::Matrix3d plane_axes() const {
    Eigen::Matrix3d axes;
    axes << row_axis, column_axis, normal().normalized();
    return axes;
  }
};

// What one file turned out to be: an image, or why it is none.
struct ScannedFile {
  std::filesystem::path file;
  std::optional<DicomSlice> slice;       // of several frames the first
  std::vector<DicomSlice> later_frames;  // of an image of several, each with its own place
  bool is_dicom = false;                 // by its first bytes
  bool damaged = false;
  std::string reason;  // why a DICOM file is no image
};

// Reads one file's header with vtk-dicom's parser. Throws nothing for what is in the file.
ScannedFile scan_dicom_file(const std::filesystem::path& file);

// Why the data elements of a DICOM file do not hold together (PS3.5, 7): one that reaches beyond
// what it is in, a sequence that is no list of items, nesting without end; empty when they do.
// Looked at before vtk-dicom's parser sees the file, which reads past the end of a sequence that is
// cut off, and takes memory for lengths before it finds them to be lies. Of the pixel data only
// fragments are looked at.
std::string flaw_of_dicom(const std::filesystem::path& file);

struct DicomFolder {
  std::filesystem::path path;
  std::vector<DicomSlice> slices;   // in byte order of the file names
  std::vector<ScannedFile> others;  // DICOM files that are no image, or damaged
};

// Its series and its other files, as dicom_contents() tells them.
DicomContents contents_of(const std::filesystem::path& folder);

// Reads the headers of all files in a folder (of its subfolders only those that a DICOMDIR in it
// lists). Throws NoInputError when it
// is empty or holds no DICOM image, BadDataError when none of its DICOM files can be read.
DicomFolder scan_dicom_folder(const std::filesystem::path& folder);

// The images that one DICOM file stands for: the series beside it that it is a slice of, its own
// frames when it has several, or what it lists when it is a DICOMDIR.
DicomFolder scan_dicom_file_or_directory(const std::filesystem::path& file);

// "scout.dcm, report.dcm and 3 more": what a warning can name without filling the screen.
std::string named_files(const std::vector<std::filesystem::path>& files);

// The images of one SeriesInstanceUID, sorted out.
struct DicomSeries {
  std::string uid, number, description, modality;
  std::size_t images = 0;          // all of them
  std::vector<DicomSlice> slices;  // those that can form one CT volume: alike in size and direction
  std::vector<std::string> passed_over;  // "2 localizers (a.dcm, b.dcm)"
  std::string unfit;                     // why it gives no CT volume; empty when it does

  bool fit() const { return unfit.empty(); }
  std::string name() const;  // series 3 "Abdomen"
  std::string line() const;  // name, images, modality, UID, and what speaks against it
};

// All series of a folder, by series number.
std::vector<DicomSeries> list_series(const DicomFolder& folder);

// The series of this UID or number, or, when `wanted` is empty, the one that is a CT volume; of
// several the one with most slices. What was chosen among others, why, and all that was passed over
// goes into `warnings`. Throws BadDataError when there is no such series or none gives a CT volume.
DicomSeries choose_series(const DicomFolder& folder, const std::string& wanted,
                          std::vector<std::string>& warnings);

// Two positions nearer than this are one place.
inline constexpr double kSamePlace_mm = 1e-3;

// Which of many things share a value, values in order: numbers as numbers, 2 before 10.
struct SameValue {
  std::string value;
  std::vector<std::size_t> members;
};
std::vector<SameValue> parted_by(const std::vector<std::string>& values);

// What is left of a series.
struct SeriesPart {
  std::vector<DicomSlice> slices;
  std::int64_t time_points = 1;  // volumes of the same places that there were
  std::vector<std::string> warnings;
};

// Parallel slices of one series in the order of their positions along the normal. Nothing but
// ImagePositionPatient and ImageOrientationPatient counts: file names, instance numbers,
// SliceThickness and SpacingBetweenSlices are often wrong.
struct DicomStack {
  std::vector<DicomSlice> slices;
  PlaneStack planes;      // theirs, along_mm increasing
  double spacing_mm = 0;  // of the regular grid: the mean gap, or the median if uneven
  bool even = true;
  double tilt_degrees = 0;       // between the stack's course and the normal; 0 = upright
  std::int64_t time_points = 1;  // volumes of the same places that the series holds; this is one
  std::vector<std::string> warnings;

  bool regular() const { return even && tilt_degrees == 0; }
};

// Sorts the slices of one series (equal orientation, size and pixel spacing; at least two), drops
// copies, takes the one of several volumes of the same places that options.time says, and measures
// gaps and tilt. What had to be mended is told in `warnings`. With options.strict,
// uneven gaps, missing and repeated slices are refused instead. Throws BadDataError also when all
// slices lie in one place, two that differ lie in the same one, or a gap is too wide to fill.
DicomStack sorted_stack(std::vector<DicomSlice> slices, const std::filesystem::path& folder,
                        const VolumeReadOptions& options);

enum class DicomCoding { native, lossy_jpeg, lossless_jpeg, jpeg_ls, jpeg_2000, rle, unknown };

// What a transfer syntax stands for. No syntax at all is a file without a meta group, which is
// native (uncompressed) by PS3.10.
DicomCoding coding_of(const std::string& transfer_syntax);

// Decompresses one frame with GDCM's codecs: rows × columns values of bits_allocated bits in the
// machine's byte order. GDCM's file parser, which ends the program on damaged headers, is not
// involved. Throws BadDataError naming the file.
std::vector<std::byte> decompress(const DicomSlice& slice, DicomCoding coding);

// Hounsfield units of air: what padding outside the scanner's field of view becomes.
inline constexpr std::int16_t kAir_hu = -1000;

// Decodes slices of equal size into the volume, one after another, as Hounsfield units: every
// slice's own rescale applied, padding turned into air. Of each slice only the columns and rows of
// `window` are kept; volume.size must be theirs times the number of slices. Slices are decoded in
// parallel. The volume becomes real where a value asks for it, or when `real` does. Throws
// BadDataError naming the file: truncated, damaged, colour, several frames, or in a coding that is
// not read, such as lossy JPEG of 8 or 12 bits, which cannot hold CT values.
void decode_slices(std::span<const DicomSlice> slices, const IndexBox& window, Volume& volume,
                   const RunContext& context, bool real = false);

// The segmentation or the contours in a file, or the CT volume of a folder of DICOM files (not of
// its subfolders), of a file of several frames, of the series that one slice belongs to, or of a
// DICOMDIR, in Hounsfield units. Files that are not
// DICOM are passed over. Of several series options.series is taken, or the one that is a CT volume,
// and `warnings` says which, why, and what was passed over. The grid comes from
// ImagePositionPatient alone; gantry tilt and uneven spacing are resampled to a regular grid, with
// a warning. Throws NoInputError when the folder holds no DICOM, BadDataError for anything that
// cannot be a trustworthy CT volume.
Volume read_dicom(const std::filesystem::path& path, const VolumeReadOptions& options,
                  const RunContext& context);

using Polygon2 = std::vector<Eigen::Vector2d>;
// Stretches of a row, in increasing order and apart: from, to.
using Spans = std::vector<std::pair<double, double>>;

// What closed contours in one plane enclose: their union, but for one that lies inside another,
// which is a hole in it, as one inside that hole is an island. The same contour twice counts once.
// Each by itself encloses what the even-odd rule says, so that a hole by keyhole is a hole, too.
class ContourRegion {
 public:
  // One contour, or several that the even-odd rule holds for together.
  using Contour = std::vector<Polygon2>;

  explicit ContourRegion(std::vector<Contour> contours);

  // What of a row lies inside. With a `reach` what is that near to the edge belongs to it, on
  // either side of a hole's edge, too.
  Spans row(double y, double reach = 0) const;
  std::size_t holes() const { return holes_; }
  std::size_t repeated() const { return repeated_; }

 private:
  struct Layered {
    Contour contour;
    std::size_t depth = 0;  // even adds to what lies below, odd takes away
  };
  std::vector<Layered> contours_;  // by depth
  std::size_t holes_ = 0, repeated_ = 0;
};

enum class DicomMaskKind { none, segmentation, contours };
// What a DICOM file holds in place of an image, by its SOP class: a segmentation (SEG) or contours
// (RTSTRUCT). None for a file that cannot be read.
DicomMaskKind dicom_mask_kind(const std::filesystem::path& file);

// A DICOM segmentation (PS3.3, C.8.20): binary, fractional (from one half on) or a label map. Each
// frame lies by its own corner, and is as thick as the slice of options.scan that it lies on; see
// slabs_of. Segments keep their numbers and names and may overlap; options.label chooses, and
// options.time where frames tell several phases. Throws BadDataError.
Volume read_dicom_segmentation(const std::filesystem::path& file, const VolumeReadOptions& options);

// The closed contours of an RTSTRUCT (PS3.3, C.8.8.6) as a mask, a label for each region of
// interest, finer in the plane than any CT. Contours in one plane are united, but for one inside
// another, which is a hole; see ContourRegion. Contours that a program drew round the voxels of
// options.scan, along their edges or from centre to centre, give these voxels back, on the scan's
// grid. A region's number and name choose it. Throws BadDataError.
Volume read_dicom_contours(const std::filesystem::path& file, const VolumeReadOptions& options);

// Warns where a mask names another frame of reference than options.scan; empty = it names none.
void warn_of_other_space(const std::string& frame_of_reference_uid,
                         const VolumeReadOptions& options, std::vector<std::string>& warnings);

// The only segmentation or contours among the DICOM files of a folder; empty where there are none.
// Throws BadDataError where there are several.
std::filesystem::path mask_among(std::vector<std::filesystem::path> files,
                                 const std::filesystem::path& folder);

// What the rest of the module volume calls of the loaded one.
struct DicomReaders {
  decltype(&read_dicom) read;
  decltype(&mask_among) mask;
  decltype(&contents_of) contents;
};

}  // namespace organbake

// The door of the module organbake_dicom, which alone links vtk-dicom, VTK and GDCM.
extern "C" __attribute__((visibility("default"))) void organbake_dicom(
    organbake::DicomReaders& readers);
