// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/read_volume.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

#include "dicom/dicom_masks.h"
#include "dicom/dicom_reader.h"
#include "files/byte_stream.h"
#include "files/header_text.h"
#include "files/metaimage_reader.h"
#include "files/nifti_reader.h"
#include "files/nrrd_reader.h"
#include "files/unzipped_folder.h"
#include "files/vti_reader.h"
#include "labels/mask_labels.h"
#include "organbake/core/error.h"
#include "organbake/volume/dicom_folder.h"
#include "organbake/volume/label_names_file.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

bool starts_nifti(std::string_view first) {
  // The header's own size, 348 (or 540 in NIfTI-2), in either byte order.
  for (const std::string_view size :
       {std::string_view("\x5c\x01\0\0", 4), std::string_view("\0\0\x01\x5c", 4),
        std::string_view("\x1c\x02\0\0", 4), std::string_view("\0\0\x02\x1c", 4)}) {
    if (first.substr(0, 4) == size) return true;
  }
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
  std::array<std::byte, 512> bytes{};
  const std::size_t count = ByteStream(path).read(bytes);
  if (count == 0) throw BadDataError(path, "is empty");
  const std::string_view first(reinterpret_cast<const char*>(bytes.data()), count);
  const std::string ending = lower_case(path.extension().string());
  if (starts_zip(first)) return read_zip(path, options, context);
  const bool is_dicom = count >= 132 && first.substr(128, 4) == "DICM";
  if (!is_dicom && !options.series.empty()) {
    throw UsageError("series \"" + options.series + "\" is asked for, but " + path.string() +
                     " is a file; only a DICOM folder has series");
  }
  if (first.rfind("NRRD000", 0) == 0) return read_nrrd(path, options);
  // Both files of a pair may be named; the .img has no header of its own.
  const bool pair = ending == ".img" && fs::exists(fs::path(path).replace_extension(".hdr"));
  if (first.rfind("\x1f\x8b", 0) == 0 || starts_nifti(first) || pair) {
    return read_nifti(path, options);
  }
  if (is_dicom) {
    switch (dicom_mask_kind(path)) {
      case DicomMaskKind::segmentation:
        return read_dicom_segmentation(path, options);
      case DicomMaskKind::contours:
        return read_dicom_contours(path, options);
      default:
        return read_dicom(path, options, context);
    }
  }
  if (ending == ".vti" || first.find("<VTKFile") != std::string_view::npos)
    return read_vti(path, options);
  if (ending == ".mha" || ending == ".mhd") return read_metaimage(path, options);
  if (first.starts_with("# vtk DataFile")) {
    throw BadDataError(path,
                       "is a file of VTK's old format (.vtk), which tells no directions; save it "
                       "as .vti (in ParaView: File, Save Data) or .nii.gz. A surface in it is read "
                       "with --mesh");
  }
  throw BadDataError(path,
                     "is not a volume: NIfTI (.nii, .nii.gz, .hdr), MetaImage (.mha, .mhd), NRRD "
                     "(.nrrd, .nhdr), VTI, or a folder or zip of DICOM files is needed");
}

bool starts_dicom(const fs::path& file) {
  std::array<std::byte, 132> bytes{};
  const std::size_t count = ByteStream(file).read(bytes);
  const std::string_view first(reinterpret_cast<const char*>(bytes.data()), count);
  return count == bytes.size() && first.substr(128) == "DICM";
}

std::vector<fs::path> dicom_files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file() && starts_dicom(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// The segmentation or the contours in a folder that is given as a mask; empty when it holds none.
fs::path mask_file_in(const fs::path& folder) {
  std::vector<fs::path> found = dicom_files_in(folder);
  std::erase_if(found,
                [](const fs::path& file) { return dicom_mask_kind(file) == DicomMaskKind::none; });
  if (found.empty()) return {};
  if (found.size() == 1) return found.front();
  throw BadDataError(folder, "holds " + std::to_string(found.size()) + " masks (" +
                                 named_files(found) + "); give one of these files");
}

constexpr std::string_view kVolumeEndings[] = {".nii.gz", ".nii", ".nrrd", ".mha", ".vti"};

// "liver" of "liver.nii.gz"; empty when the file is no volume.
std::string mask_name(const fs::path& file) {
  const std::string name = file.filename().string();
  for (const std::string_view ending : kVolumeEndings) {
    if (name.size() > ending.size() && lower_case(name).ends_with(ending))
      return name.substr(0, name.size() - ending.size());
  }
  return {};
}

std::vector<fs::path> files_of_masks(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file() && !mask_name(entry.path()).empty()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
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
    if (const fs::path mask = mask_file_in(path); !mask.empty()) {
      return read_volume(mask, options, context);
    }
  }
  const bool masks = folder && options.is_mask && is_folder_of_masks(path);
  Volume volume = masks    ? read_folder_of_masks(path, options, context)
                  : folder ? read_dicom(path, options, context)
                           : read_file_by_content(path, options, context);
  if (!options.grid_only) check_volume(volume, path.string());
  if (options.is_mask) make_labels(volume);
  if (!options.label_names.empty() && !is_layered(volume)) volume.label_names = options.label_names;
  if (!options.label.empty() && volume.chosen_label == 0) {
    choose_label(volume, options, path.string());
  }
  return volume;
}

Volume read_volume(const fs::path& path, const RunContext& context) {
  return read_volume(path, VolumeReadOptions{}, context);
}

}  // namespace organbake
