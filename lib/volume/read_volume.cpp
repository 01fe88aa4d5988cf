// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/read_volume.h"

#include <array>
#include <cstring>
#include <string_view>

#include "core/error.h"
#include "volume/byte_stream.h"
#include "volume/dicom_reader.h"
#include "volume/header_text.h"
#include "volume/metaimage_reader.h"
#include "volume/nifti_reader.h"
#include "volume/nrrd_reader.h"
#include "volume/vti_reader.h"

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

Volume read_file_by_content(const fs::path& path, const VolumeReadOptions& options) {
  std::array<std::byte, 512> bytes{};
  const std::size_t count = ByteStream(path).read(bytes);
  if (count == 0) throw BadDataError(path, "is empty");
  const std::string_view first(reinterpret_cast<const char*>(bytes.data()), count);
  const std::string ending = lower_case(path.extension().string());
  if (first.rfind("NRRD000", 0) == 0) return read_nrrd(path, options);
  if (first.rfind("\x1f\x8b", 0) == 0)
    return read_nifti(path, ByteStream::Coding::deflate, options);
  if (starts_nifti(first)) return read_nifti(path, ByteStream::Coding::raw, options);
  if (count >= 132 && first.substr(128, 4) == "DICM") {
    throw BadDataError(path, "is a single DICOM file; give the folder that holds the series");
  }
  if (ending == ".vti" || first.find("<VTKFile") != std::string_view::npos)
    return read_vti(path, options);
  if (ending == ".mha" || ending == ".mhd") return read_metaimage(path, options);
  throw BadDataError(path,
                     "is not a volume: NIfTI (.nii, .nii.gz), MetaImage (.mha, .mhd), NRRD "
                     "(.nrrd, .nhdr), VTI or a folder of DICOM files is needed");
}

}  // namespace

Volume read_volume(const fs::path& path, const VolumeReadOptions& options,
                   const RunContext& context) {
  context.throw_if_cancelled();
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) throw NoInputError(path, "does not exist");
  const bool folder = fs::is_directory(status);
  if (!folder && !options.series.empty()) {
    throw UsageError("series \"" + options.series + "\" is asked for, but " + path.string() +
                     " is a file; only a DICOM folder has series");
  }
  Volume volume =
      folder ? read_dicom_folder(path, options, context) : read_file_by_content(path, options);
  check_volume(volume, path.string());
  return volume;
}

Volume read_volume(const fs::path& path, const RunContext& context) {
  return read_volume(path, VolumeReadOptions{}, context);
}

}  // namespace organbake
