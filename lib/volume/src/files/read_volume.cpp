// SPDX-License-Identifier: GPL-3.0-or-later
// The door of all volumes: tells a file's kind by its content, a folder's by what lies in it, a
// zip's by what it holds unpacked, and chooses the time and the label that were asked for.
#include "organbake/volume/read_volume.h"

#include <minizip/unzip.h>
#include <algorithm>
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>

#include "dicom/dicom.h"
#include "files/volume_files.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

// The label of each name is its channel, counted from 1. Classes count from 0, the background;
// where there is a name for every channel, from the first.
std::vector<LabelName> channel_names(std::int64_t count, const VolumeReadOptions& options) {
  std::vector<LabelName> names;
  const bool has_background = std::cmp_not_equal(options.label_names.size(), count);
  for (const LabelName& known : options.label_names) {
    const int channel = known.label + (has_background ? 1 : 0);
    if (channel < 1 || channel > count) continue;
    names.push_back({channel, known.name, static_cast<int>(names.size())});
  }
  if (!names.empty()) return names;
  for (std::int64_t layer = 0; layer < count; ++layer) {
    const int number = static_cast<int>(layer) + 1;
    names.push_back({number, "channel " + std::to_string(number), static_cast<int>(layer)});
  }
  return names;
}

std::string channel_advice(std::int64_t count, const std::vector<LabelName>& names,
                           bool may_be_times) {
  const std::string all = std::to_string(count);
  return "holds " + all + " volumes of one place. If each is a mask of its own, choose one with " +
         "--label \"" + names.front().name + "\" … \"" + names.back().name + "\"" +
         (may_be_times ? "; if they are labels over time, with --time 1…" + all : "");
}

}  // namespace

std::int64_t chosen_time(const TimePoints& times, const VolumeReadOptions& options,
                         const std::string& name) {
  if (times.count < 1)
    throw BadDataError(name + ": holds " + std::to_string(times.count) + " time points");
  if (times.count == 1 && (options.is_mask || options.lasting)) return 0;
  if (options.time > times.count)
    throw UsageError(name + ": holds " + std::to_string(times.count) +
                     (times.count == 1 ? " time point" : " time points") + ", no --time " +
                     std::to_string(options.time));
  if (options.time > 0) return options.time - 1;
  if (times.count == 1 || options.any_time) return 0;
  throw BadDataError(name + ": holds " + std::to_string(times.count) + " time points" +
                     (times.step.empty() ? "" : ", " + times.step) + "; choose one with --time 1…" +
                     std::to_string(times.count));
}

Volume read_one_of(const TimePoints& times, const VolumeReadOptions& options,
                   const std::string& name, const std::function<Volume(std::int64_t)>& read_one) {
  constexpr std::int64_t kMostChannels = 1000;
  const bool channels = options.is_mask && times.count > 1 && times.count <= kMostChannels &&
                        !options.any_time && (options.time == 0 || options.only_channels);
  if (!channels) return read_one(chosen_time(times, options, name));
  const std::vector<LabelName> names = channel_names(times.count, options);
  Volume mask = read_separate_masks(
      options, name, names, channel_advice(times.count, names, !options.only_channels),
      [&](std::int64_t layer) {
        return read_one(names[static_cast<std::size_t>(layer)].label - 1);
      });
  mask.time_points = 1;  // they are no times
  return mask;
}

namespace {

constexpr std::uint64_t kMostUnpackedBytes = std::uint64_t{1} << 34;  // 16 GiB
constexpr std::size_t kMostFiles = 100'000;
constexpr int kNumberDigits = 6;

struct CloseZip {
  void operator()(void* zip) const { unzClose(zip); }
};

[[noreturn]] void damaged(const fs::path& zip) { throw BadDataError(zip, "is a damaged zip"); }

struct Entry {
  std::string name;  // with its folders
  std::uint64_t bytes = 0;
  bool encrypted = false;

  std::string base() const { return name.substr(name.find_last_of("/\\") + 1); }
  bool wanted() const {
    return bytes > 0 && !base().empty() && !base().starts_with("._") &&
           name.find("__MACOSX/") == std::string::npos;
  }
};

Entry entry_of(void* zip, const fs::path& path) {
  unz_file_info64 info{};
  if (unzGetCurrentFileInfo64(zip, &info, nullptr, 0, nullptr, 0, nullptr, 0) != UNZ_OK)
    damaged(path);
  Entry entry;
  entry.name.resize(info.size_filename);
  if (unzGetCurrentFileInfo64(zip, nullptr, entry.name.data(), info.size_filename, nullptr, 0,
                              nullptr, 0) != UNZ_OK)
    damaged(path);
  entry.bytes = info.uncompressed_size;
  entry.encrypted = info.flag & 1;
  return entry;
}

std::vector<std::byte> content_of(void* zip, const Entry& entry, const fs::path& path) {
  if (unzOpenCurrentFile(zip) != UNZ_OK) damaged(path);
  constexpr std::size_t kPiece = 1 << 20;
  std::vector<std::byte> bytes;
  // What the entry claims is not trusted with memory before it is there.
  for (;;) {
    const std::size_t had = bytes.size();
    bytes.resize(had + kPiece);
    const int got = unzReadCurrentFile(zip, bytes.data() + had, kPiece);
    if (got < 0) damaged(path);
    bytes.resize(had + static_cast<std::size_t>(got));
    if (got == 0) break;
    if (bytes.size() > entry.bytes) damaged(path);
  }
  // Closing compares the checksum.
  if (unzCloseCurrentFile(zip) != UNZ_OK || bytes.size() != entry.bytes) damaged(path);
  return bytes;
}

}  // namespace

UnzippedFolder::UnzippedFolder(const fs::path& zip) : zip_(zip) {
  const std::unique_ptr<void, CloseZip> open(unzOpen64(zip.c_str()));
  if (!open) damaged(zip);
  std::uint64_t total = 0;
  std::size_t files = 0;
  for (int at = unzGoToFirstFile(open.get()); at == UNZ_OK; at = unzGoToNextFile(open.get())) {
    const Entry entry = entry_of(open.get(), zip);
    if (!entry.wanted()) continue;
    if (entry.encrypted) throw BadDataError(zip, "is encrypted; unpack it first");
    total += entry.bytes;
    if (++files > kMostFiles || total > kMostUnpackedBytes)
      throw BadDataError(zip, "holds more than a scan would (" + std::to_string(total >> 20) +
                                  " MB in " + std::to_string(files) +
                                  " files so far); unpack it and give the folder of one series");
    // Numbers keep apart what has the same name in two folders, and keep the zip's order.
    path_ = folder_.path() / (padded(files, kNumberDigits) + "_" + entry.base());
    const std::vector<std::byte> content = content_of(open.get(), entry, zip);
    // A zip may hold itself without end.
    if (starts_zip({reinterpret_cast<const char*>(content.data()), content.size()}))
      throw BadDataError(zip, "holds another zip (" + entry.name + "); unpack it first");
    write_file_atomically(path_, content);
  }
  if (files == 0) throw BadDataError(zip, "is a zip without files");
  if (files > 1) path_ = folder_.path();
}

std::string UnzippedFolder::about_the_zip(const std::string& message) const {
  std::string text = message;
  const std::string inside = folder_.path().string();
  for (std::size_t at; (at = text.find(inside)) != std::string::npos;)
    text.replace(at, inside.size(), zip_.string());
  return text;
}

namespace {

// Loaded with the first DICOM file: its libraries are heavier than all else that reads volumes.
const DicomReaders& dicom() {
  static const DicomReaders readers = [] {
    DicomReaders found;
    reinterpret_cast<decltype(&organbake_dicom)>(module_door("organbake_dicom", "organbake_dicom"))(
        found);
    return found;
  }();
  return readers;
}

bool starts_nifti(std::string_view first) {
  // The header's own size, 348 (or 540 in NIfTI-2), in either byte order.
  for (const std::string_view size :
       {std::string_view("\x5c\x01\0\0", 4), std::string_view("\0\0\x01\x5c", 4),
        std::string_view("\x1c\x02\0\0", 4), std::string_view("\0\0\x02\x1c", 4)})
    if (first.substr(0, 4) == size) return true;
  return false;
}

// A series as a PACS or a browser packs it.
Volume read_zip(const fs::path& path, const VolumeReadOptions& options, const RunContext& context) {
  const UnzippedFolder unzipped(path);
  try {
    Volume volume = read_volume(unzipped.path(), options, context);
    for (std::string& warning : volume.warnings) warning = unzipped.about_the_zip(warning);
    return volume;
  } catch (const BadDataError& error) {
    throw BadDataError(unzipped.about_the_zip(error.what()));
  } catch (const NoInputError& error) {
    throw BadDataError(unzipped.about_the_zip(error.what()));
  }
}

Volume read_file_by_content(const fs::path& path, const VolumeReadOptions& options,
                            const RunContext& context) {
  const std::string first = read_beginning(path, 512);
  if (first.empty()) throw BadDataError(path, "is empty");
  const std::string ending = lower_ending(path);
  if (starts_zip(first)) return read_zip(path, options, context);
  const bool is_dicom = starts_dicom(first);
  if (!is_dicom && !options.series.empty())
    throw UsageError("series \"" + options.series + "\" is asked for, but " + path.string() +
                     " is a file; only a DICOM folder has series");
  if (first.rfind("NRRD000", 0) == 0) return read_nrrd(path, options);
  // Both files of a pair may be named; the .img has no header of its own.
  const bool pair = ending == ".img" && fs::exists(fs::path(path).replace_extension(".hdr"));
  if (first.rfind("\x1f\x8b", 0) == 0 || starts_nifti(first) || pair)
    return read_nifti(path, options);
  if (is_dicom) return dicom().read(path, options, context);
  if (ending == ".vti" || first.find("<VTKFile") != first.npos) return read_vti(path, options);
  if (ending == ".mha" || ending == ".mhd") return read_metaimage(path, options);
  if (first.starts_with("# vtk DataFile"))
    throw BadDataError(path,
                       "is a file of VTK's old format (.vtk), which tells no directions; save it "
                       "as .vti (in ParaView: File, Save Data) or .nii.gz. A surface in it is read "
                       "with --mesh");
  throw BadDataError(path,
                     "is not a volume: NIfTI (.nii, .nii.gz, .hdr), MetaImage (.mha, .mhd), NRRD "
                     "(.nrrd, .nhdr), VTI, or a folder or zip of DICOM files is needed");
}

// The regular files of a folder that `takes` takes, in the order of their names.
template <class Takes>
std::vector<fs::path> files_in(const fs::path& folder, const Takes& takes) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && takes(entry.path())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<fs::path> dicom_files_in(const fs::path& folder) {
  return files_in(folder,
                  [](const fs::path& file) { return starts_dicom(read_beginning(file, 132)); });
}

constexpr std::string_view kVolumeEndings[] = {".nii.gz", ".nii", ".nrrd", ".mha", ".vti"};

// "liver" of "liver.nii.gz"; empty when the file is no volume.
std::string mask_name(const fs::path& file) {
  const std::string name = file.filename().string();
  for (const std::string_view ending : kVolumeEndings)
    if (name.size() > ending.size() && lower_case(name).ends_with(ending))
      return name.substr(0, name.size() - ending.size());
  return {};
}

std::vector<fs::path> files_of_masks(const fs::path& folder) {
  return files_in(folder, [](const fs::path& file) { return !mask_name(file).empty(); });
}

Volume read_folder_of_masks(const fs::path& folder, const VolumeReadOptions& options,
                            const RunContext& context) {
  const std::vector<fs::path> files = files_of_masks(folder);
  std::vector<LabelName> names;
  for (const fs::path& file : files) {
    const int layer = static_cast<int>(names.size());
    names.push_back({layer + 1, mask_name(file), layer});
  }
  VolumeReadOptions one = options;
  one.label.clear();
  one.is_mask = true;
  return read_separate_masks(options, folder.string(), names,
                             "holds a mask in each file; choose one by its name, as in --label \"" +
                                 names.front().name + "\": it holds " + label_list(names),
                             [&](std::int64_t layer) {
                               return read_volume(files[static_cast<std::size_t>(layer)], one,
                                                  context);
                             });
}

void take_as_labels(Volume& volume, const fs::path& path) {
  make_labels(volume);
  const ValueRange range = value_range(volume);
  if (range.min >= 0) return;
  throw BadDataError(path, "holds values down to −" + to_text(-range.min) +
                               ", and a mask's labels are 0 and above; it may be the scan: check "
                               "that CT and mask are not swapped");
}

bool is_layered(const Volume& mask) {
  return std::any_of(mask.label_names.begin(), mask.label_names.end(),
                     [](const LabelName& name) { return name.layer > 0; });
}

}  // namespace

bool is_folder_of_masks(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error) || files_of_masks(path).empty()) return false;
  return dicom_files_in(path).empty();
}

Volume read_volume(const fs::path& path, const VolumeReadOptions& options,
                   const RunContext& context) {
  context.throw_if_cancelled();
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) throw NoInputError(path, "does not exist");
  const bool folder = fs::is_directory(status);
  if (folder && options.is_mask) {
    const std::vector<fs::path> files = dicom_files_in(path);
    const fs::path mask = files.empty() ? fs::path() : dicom().mask(files, path);
    if (!mask.empty()) return read_volume(mask, options, context);
  }
  const bool masks = folder && options.is_mask && is_folder_of_masks(path);
  Volume volume = masks    ? read_folder_of_masks(path, options, context)
                  : folder ? dicom().read(path, options, context)
                           : read_file_by_content(path, options, context);
  if (!options.grid_only) check_volume(volume, path.string());
  if (options.is_mask && !options.grid_only) take_as_labels(volume, path);
  if (!options.label_names.empty() && !is_layered(volume)) volume.label_names = options.label_names;
  if (!options.label.empty() && volume.chosen_label == 0)
    choose_label(volume, options, path.string());
  return volume;
}

DicomContents dicom_contents(const fs::path& folder) { return dicom().contents(folder); }

Volume read_volume(const fs::path& path, const RunContext& context) {
  return read_volume(path, VolumeReadOptions{}, context);
}

}  // namespace organbake
