// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The room of files: bytes, numbers in them, time points, a reader for each format, and what a text
// chooses among the labels of masks.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "grid/grids.h"
#include "organbake/core/scalar_type.h"
#include "organbake/core/temporary_files.h"
#include "organbake/core/text.h"
#include "organbake/volume/read_volume.h"
#include "organbake/volume/volume.h"

namespace organbake {

// Where a ByteStream's bytes come from; one class for each coding.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  // Fills `out` as far as it can; fewer bytes only at the end.
  virtual std::size_t read(std::span<std::byte> out) = 0;
  // Passes over bytes; fewer only at the end. How many.
  virtual std::uint64_t skip(std::uint64_t count);
  // Fills `out` from so many bytes ahead, by any number of threads at once, and stays where it is.
  // Only where reads_ahead().
  virtual std::size_t read_ahead(std::uint64_t, std::span<std::byte>) const { return 0; }
  virtual bool reads_ahead() const { return false; }
};

// The bytes of a file from an offset on, decompressed on the way in small pieces, so that voxels
// can be read to where they stay and a lying header costs no memory. Throws NoInputError when the
// file cannot be opened, BadDataError when it is damaged, IoError when the system fails.
class ByteStream {
 public:
  enum class Coding { raw, deflate /* gzip or zlib, told by its first bytes */, bzip2 };

  explicit ByteStream(const std::filesystem::path& file, Coding coding = Coding::raw,
                      std::uint64_t offset = 0);

  // From a source of another kind; `file` is for errors.
  ByteStream(std::filesystem::path file, std::unique_ptr<ByteSource> source,
             std::uint64_t most_possible_bytes);

  const std::filesystem::path& file() const { return file_; }
  std::size_t read(std::span<std::byte> out) { return source_->read(out); }
  // Throws BadDataError ("truncated") when fewer bytes are left.
  void read_exactly(std::span<std::byte> out);
  void skip(std::uint64_t count);  // without reading, where bytes are not packed
  // Whether read_ahead() can read from anywhere, by several threads at once: of a file that is not
  // packed. Throws as read_exactly() does, and leaves the stream where it is.
  bool reads_ahead() const { return source_->reads_ahead(); }
  void read_ahead(std::uint64_t bytes, std::span<std::byte> out) const;
  // No stream of this size and coding can hold more.
  std::uint64_t most_possible_bytes() const { return most_possible_bytes_; }

 private:
  [[noreturn]] void fail_truncated() const;

  std::filesystem::path file_;
  std::unique_ptr<ByteSource> source_;
  std::uint64_t most_possible_bytes_ = 0;
};

// A part of the voxels that lies in a file of its own.
struct VoxelPart {
  std::filesystem::path file;
  std::uint64_t offset = 0;  // of its first byte
};

// The same, or the files whose names stand behind the header's field, a line each, where `named` is
// "LIST". `fields`: what that field may be called, in small letters; `mark` follows its name.
std::vector<std::filesystem::path> listed_files(const std::string& named,
                                                const std::filesystem::path& header, char mark,
                                                std::initializer_list<std::string_view> fields);

// The parts one after another, `bytes_each` of each once it is decompressed. Reading throws
// BadDataError naming the part that is too short.
ByteStream joined_parts(std::vector<VoxelPart> parts, ByteStream::Coding coding,
                        std::uint64_t bytes_each);

// Of tuples of `values` numbers of `value_bytes` each, every tuple's number `which` alone.
ByteStream every_nth_value(ByteStream tuples, std::size_t value_bytes, std::size_t values,
                           std::size_t which);

// The text part of a MetaImage or NRRD file, taken apart without regard to the locale. All throw
// BadDataError naming the file and the field.
class HeaderText {
 public:
  explicit HeaderText(const std::filesystem::path& file);

  // The next line without its end; false at the end of the header's 1 MB limit or of the file. Of
  // the file little more is read than the lines asked for: voxels may follow them.
  bool next_line(std::string& line);
  // Offset in the file of what follows the last line read.
  std::uint64_t offset() const { return offset_; }

 private:
  bool read_more();

  std::filesystem::path file_;
  ByteStream stream_;
  std::string text_;  // what was read so far
  std::uint64_t offset_ = 0;
};

// The fields of a MetaImage or NRRD header by their names in small letters. All throw BadDataError
// naming the file and the field.
class HeaderFields {
 public:
  explicit HeaderFields(const std::filesystem::path& path) : path_(path) {}

  const std::filesystem::path& path() const { return path_; }
  bool has(const std::string& field) const { return fields_.contains(field); }
  // A field's text; `otherwise` when it is missing.
  std::string get(const std::string& field, const std::string& otherwise = {}) const;
  std::int64_t integer(const std::string& field, std::int64_t otherwise) const;
  // Where a field is from, for errors.
  std::string place(const std::string& field) const { return path_.string() + ": " + field; }
  [[noreturn]] void fail(const std::string& message) const;

 protected:
  // One number under this name.
  std::int64_t one_integer(const std::string& text, const std::string& field) const;

  std::filesystem::path path_;
  std::map<std::string, std::string> fields_;
};

// Numbers separated by spaces; brackets and commas count as spaces.
std::vector<double> numbers(const std::string& text, const std::string& field);
std::vector<std::int64_t> integers(const std::string& text, const std::string& field);

// How stored values become Hounsfield units (or labels): value = slope · stored + intercept.
struct VoxelEncoding {
  ScalarType type = ScalarType::int16;
  bool big_endian = false;
  double slope = 1;
  double intercept = 0;

  bool is_plain() const { return slope == 1 && intercept == 0; }
  bool is_plain_int16() const { return type == ScalarType::int16 && is_plain(); }
  // Whatever is stored is a whole number of 16 bits.
  bool is_surely_whole() const {
    return is_plain() && (type == ScalarType::int16 || bytes_of(type) == 1);
  }
};

// Converts `count` values in the machine's byte order to whole numbers of 16 bits; false when one
// of them is none, and then `out` means nothing.
bool convert_whole(const std::byte* source, std::size_t count, const VoxelEncoding& encoding,
                   std::int16_t* out);
// The same to float32.
void convert_real(const std::byte* source, std::size_t count, const VoxelEncoding& encoding,
                  float* out);
// Converts them into the volume's values from index `first` on. The volume has its values already,
// and becomes real with the first one that is no whole number of 16 bits.
void convert_voxels(const std::byte* source, std::size_t count, const VoxelEncoding& encoding,
                    Volume& volume, std::size_t first);

// Tells of values that are NaN through the warnings; infinite ones become the largest numbers that
// can be reckoned with. Throws BadDataError when no voxel is a number.
void settle_values(Volume& volume, const std::string& name);

// Reads volume.size's voxels from the stream through small buffers, by all threads where the file
// lets them; where all of one is 0 nothing is written, and a mask's background takes no memory.
// Throws BadDataError when the data is too short (before memory is taken, where the file's size
// shows it).
void decode_voxels(ByteStream& stream, const VoxelEncoding& encoding, Volume& volume);
// The same from whitespace-separated decimal text.
void decode_text_voxels(ByteStream& stream, const VoxelEncoding& encoding, Volume& volume);

// How the voxels of one volume lie in a file of one or several: behind others, or between them.
struct VoxelLayout {
  VoxelEncoding encoding;
  bool is_text = false;
  std::int64_t time = 0, times = 1;  // this volume of so many
  bool interleaved = false;          // the volumes' values stand side by side, voxel by voxel
  bool may_go_on = false;            // other data may follow the voxels
};

// The whole of what a header announced, text or binary, or the part of it that options.region
// wants, and nothing behind it, straightened where its grid is sheared. `grid` has its place
// already; `name` is for errors.
Volume decode_region(ByteStream stream, const VoxelLayout& layout, const VolumeReadOptions& options,
                     const Shear& shear, const std::string& name, Volume grid);

// Volumes of one place at several times in one file or series.
struct TimePoints {
  std::int64_t count = 1;
  std::string step = {};  // "every 0.5 s"; empty = not known
};

// The index, from 0, of the time point that options.time asks for. Throws UsageError for one that
// isn't there, and BadDataError ("holds 5 time points; choose one with --time 1…5") when none was
// asked for and there are several, unless options.any_time lets the first stand for all.
std::int64_t chosen_time(const TimePoints& times, const VolumeReadOptions& options,
                         const std::string& name);

// One volume of a file of `times`, of which `read_one` reads one. Of a mask they may be channels,
// each a mask of its own, as one-hot and probability maps have them: "channel 2", counted from 1,
// is then options.label, or the names of options.label_names, which number them.
Volume read_one_of(const TimePoints& times, const VolumeReadOptions& options,
                   const std::string& name, const std::function<Volume(std::int64_t)>& read_one);

// MetaImage (.mha, .mhd with one raw or zlib file), as ITK writes and reads it: world = LPS, the
// TransformMatrix lists the unit vectors of the index axes one after the other. (vtkMetaImageReader
// ignores that matrix, which is why this is not it.)
Volume read_metaimage(const std::filesystem::path& path, const VolumeReadOptions& options = {});

// NIfTI-1 and NIfTI-2 in one file (.nii, .nii.gz) or as a pair (.hdr and .img, packed or not;
// either of the two may be named); either byte order. The sform is preferred, then the qform;
// without both the voxel sizes alone are used, with a warning. RAS becomes LPS. Of several time
// points options.time is taken; without it a file of several is refused, and how many it holds is
// said.
Volume read_nifti(const std::filesystem::path& path, const VolumeReadOptions& options = {});

// NRRD (.nrrd, or .nhdr with one data file): raw, ascii, gzip or bzip2, either byte order, line and
// byte skip; `space` LPS, RAS or LAS, `space directions` and `space origin`. Source:
// teem.sourceforge.net/nrrd/format.html. (vtkNrrdReader ignores the directions, which is why this
// is not it.)
Volume read_nrrd(const std::filesystem::path& path, const VolumeReadOptions& options = {});

// VTK XML image data (.vti) through VTK's reader: the active (or only) point array of one
// component. VTK has no word for the patient's axes; its world is taken as LPS millimetres.
Volume read_vti(const std::filesystem::path& path, const VolumeReadOptions& options = {});

inline bool starts_zip(std::string_view first_bytes) {
  return first_bytes.starts_with("PK\x03\x04");
}
inline bool starts_dicom(std::string_view first_bytes) {
  return first_bytes.size() >= 132 && first_bytes.substr(128, 4) == "DICM";
}

// The files of a zip, side by side in a folder that goes with this object, whatever folders they
// were in: what a PACS or a browser packs a series into. Folders, macOS's companions (__MACOSX,
// ._…) and empty files are left out. Throws BadDataError naming the zip: damaged, encrypted, of too
// many files, or larger than any scan when unpacked.
class UnzippedFolder {
 public:
  explicit UnzippedFolder(const std::filesystem::path& zip);

  // The folder, or its only file.
  const std::filesystem::path& path() const { return path_; }
  // A message about something in it, as one about the zip.
  std::string about_the_zip(const std::string& message) const;

 private:
  std::filesystem::path zip_, path_;
  TemporaryFolder folder_;
};

// What a text such as "5", "liver" or "5,7" or "spleen, liver" asks for, called "liver" or "label
// 5"; what else has one name in `with`, without a name: numbers, or names without regard to case
// and to '_', '-' and spaces. Throws BadDataError naming the labels that there are for a name that
// isn't there, for one that several have, and for a number that several layers have; UsageError for
// a number beyond 1…16777216. That voxels have the label is not looked at here.
std::vector<LabelName> chosen_labels(const std::string& text, const std::vector<LabelName>& names,
                                     const std::string& file);

// Makes options.label one label of the mask: volume.chosen_label. Of several labels the voxels all
// get the first one's number. Throws BadDataError when one of several is absent.
void choose_label(Volume& mask, const VolumeReadOptions& options, const std::string& file);

// One mask from a file of several layers, of which `read_one` reads one: options.label out of its
// layer or layers, as the first one's number; without options.label, the layers over one another.
// Throws BadDataError also when the layers that are asked for lie on different grids.
Volume read_layers(std::int64_t layers, const VolumeReadOptions& options, const std::string& file,
                   const std::vector<LabelName>& names,
                   const std::function<Volume(std::int64_t)>& read_one);

// The same where each layer is a mask of its own: every voxel of it that is not 0 gets the number
// that `names` gives the layer. Names choose; numbers, which mean nothing there, are refused with
// `advice`, unless there is but one layer.
Volume read_separate_masks(const VolumeReadOptions& options, const std::string& file,
                           const std::vector<LabelName>& names, const std::string& advice,
                           const std::function<Volume(std::int64_t)>& read_one);

}  // namespace organbake
