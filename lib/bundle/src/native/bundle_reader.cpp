// SPDX-License-Identifier: Apache-2.0
// Reads a bundle from a folder that may come from anyone. Each file has to be listed in the
// manifest and to agree with its size and SHA-256 before its content is looked at.
#include "organbake/bundle/bundle_reader.h"

#include <algorithm>
#include <set>

#include "organbake/bundle/stored_maps.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/core/sha256.h"
#include "organbake/geometry/ply.h"
#include "organbake/image/exr.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

constexpr const char* kWhenChanged =
    "; bake the bundle anew, or, where you edited a map yourself, take it over by "
    "'organbake reseal'";
constexpr std::size_t kMostManifestBytes = std::size_t{1} << 26;
constexpr std::uint64_t kMostFileBytes = std::uint64_t{1} << 36;

// Throws for what the system doesn't let us look at.
bool is_there(const fs::path& path) {
  std::error_code error;
  const bool there = fs::exists(path, error);
  if (error) throw NoInputError(path, "cannot be looked at: " + error.message());
  return there;
}

const BundleFile* listed(const Manifest& manifest, const std::string& file) {
  const auto found = std::lower_bound(
      manifest.files.begin(), manifest.files.end(), file,
      [](const BundleFile& entry, const std::string& path) { return entry.path < path; });
  return found != manifest.files.end() && found->path == file ? &*found : nullptr;
}

void check_size(const ChannelImage& image, const Intrinsics& camera, const std::string& name) {
  if (image.width == camera.width && image.height == camera.height) return;
  throw BadDataError(name + ": is " + std::to_string(image.width) + " × " +
                     std::to_string(image.height) + ", its camera " + std::to_string(camera.width) +
                     " × " + std::to_string(camera.height) + " pixels");
}

// The files of a bundle that the manifest vouches for.
class ListedFiles : public BundleFiles {
 public:
  explicit ListedFiles(const BundleReader& reader) : reader_(reader) {}
  bool has(const std::string& file) const override { return reader_.has(file); }
  std::vector<std::byte> bytes(const std::string& file) const override {
    return reader_.read(file);
  }
  ChannelImage image(const std::string& file) const override {
    return parse_exr(bytes(file), where(file));
  }
  std::string where(const std::string& file) const override {
    return (reader_.folder() / file).string();
  }

 private:
  const BundleReader& reader_;
};

}  // namespace

BundleReader::BundleReader(fs::path folder) : folder_(std::move(folder)) {
  if (!is_there(folder_)) throw NoInputError(folder_, "there is no such folder");
  if (!fs::is_directory(folder_))
    throw NoInputError(folder_, "is a file; a bundle is the folder made by 'organbake bake'");
  const fs::path manifest = folder_ / "manifest.json";
  if (!is_there(manifest)) {
    throw NoInputError(folder_, "has no manifest.json; bundles are made by 'organbake bake'");
  }
  const std::vector<std::byte> bytes =
      read_file_inside(folder_, "manifest.json", kMostManifestBytes);
  manifest_ = manifest_from_json({reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                                 manifest.string());
}

bool BundleReader::has(const std::string& file) const { return listed(manifest_, file) != nullptr; }

std::vector<std::byte> BundleReader::read_unchecked(const std::string& file) const {
  return read_file_inside(folder_, file, kMostFileBytes);
}

std::vector<std::byte> BundleReader::read(const std::string& file) const {
  const BundleFile* entry = listed(manifest_, file);
  if (!entry) throw BadDataError(folder_ / "manifest.json", "does not list '" + file + "'");
  const fs::path path = folder_ / file;
  std::vector<std::byte> bytes = read_file_inside(folder_, file, kMostFileBytes);
  if (bytes.size() != entry->bytes) {
    throw BadDataError(path, "is " + std::to_string(bytes.size()) + " bytes, the manifest says " +
                                 std::to_string(entry->bytes) + kWhenChanged);
  }
  if (sha256_hex(bytes) != entry->sha256) {
    throw BadDataError(path,
                       std::string("does not match its SHA-256 in the manifest") + kWhenChanged);
  }
  return bytes;
}

Bundle BundleReader::read_frame() const {
  return organbake::read_frame(ListedFiles(*this), manifest_);
}

CameraMaps BundleReader::read_maps(std::size_t camera, const Intrinsics& lens,
                                   std::size_t faces) const {
  const std::string folder = camera_folder(camera);
  const std::size_t pixels = std::size_t(lens.width) * lens.height;
  const std::string where = (folder_ / folder).string();
  const auto open = [&](const char* name, const std::vector<std::string>& channels) {
    const std::string file = folder + "/" + name, full = where + "/" + name;
    ChannelImage image = parse_exr(read(file), full, pixels, channels);
    check_size(image, lens, full);
    return image;
  };
  CameraMaps maps;
  maps.width = lens.width;
  maps.height = lens.height;
  maps.color = colors_from_image(open("color.exr", {"R", "G", "B"}), where + "/color.exr");
  ChannelImage depth = open("depth.exr", {"Y"}),
               micro = open("micro.exr", {"Y", "face", "confidence"});
  maps.depth_mm = depth.take_floats("Y", where + "/depth.exr");
  maps.height_mm = micro.take_floats("Y", where + "/micro.exr");
  maps.face = micro.take_uints("face", where + "/micro.exr");
  maps.confidence = micro.take_floats("confidence", where + "/micro.exr");
  check_maps(maps, faces, where);
  return maps;
}

Bundle BundleReader::read_all() const {
  Bundle bundle = read_frame();
  const std::size_t faces = shell_face_count(bundle);
  parallel_for(std::size_t{0}, bundle.maps.size(), [&](std::size_t c) {
    bundle.maps[c] = read_maps(c, bundle.cameras.cameras[c].intrinsics, faces);
  });
  return bundle;
}

TriangleMesh BundleReader::read_surface() const {
  return parse_ply(read("surface.ply"), (folder_ / "surface.ply").string());
}

void BundleReader::verify() const {
  std::set<std::string> known = {"manifest.json"};
  for (const BundleFile& file : manifest_.files) known.insert(file.path);
  for (const auto& path : list_all_but_folders(folder_)) {
    if (!known.contains(path.generic_string())) {
      throw BadDataError(folder_ / path, "is not listed in the bundle's manifest");
    }
  }
  parallel_for(std::size_t{0}, manifest_.files.size(),
               [&](std::size_t i) { read(manifest_.files[i].path); });
  read_all();
  if (has("surface.ply")) read_surface();
}

}  // namespace organbake
