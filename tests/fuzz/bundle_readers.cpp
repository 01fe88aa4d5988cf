// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/bundle/bundle_reader.h"

#include "fuzz/readers.h"
#include "organbake/bundle/bundle_pack.h"
#include "organbake/bundle/map_code.h"
#include "organbake/bundle/reseal.h"
#include "organbake/core/files.h"
#include "support/meshes.h"
#include "support/skins.h"
#include "support/small_bundle.h"

namespace organbake {

const std::vector<std::string> kBundleFiles = {
    "proxy.ply",         "cameras.json",      "mechanics.json",    "base.exr",
    "skin.exr",          "lighting.json",     "surface.ply",       "cam_000/depth.exr",
    "cam_000/color.exr", "cam_000/micro.exr", "cam_001/depth.exr", "cam_001/color.exr",
    "cam_001/micro.exr"};

namespace {

Manifest sealed() {
  Manifest manifest;
  manifest.name = "sealed";
  manifest.generator = "tests";
  return manifest;
}

void read_bundle(std::span<const std::byte> bytes, const InputFolder& folder) {
  const std::filesystem::path bundle = folder.parts(kBundleFiles, bytes);
  write_manifest(bundle, sealed());
  BundleReader(bundle).verify();
}

// One whose files were changed since: what `reseal` makes of it.
void reseal_bundle(std::span<const std::byte> bytes, const InputFolder& folder) {
  const std::filesystem::path bundle = folder.parts(kBundleFiles, bytes);
  write_manifest(bundle, sealed());
  reseal(bundle);
}

void read_pack_contents(std::span<const std::byte> bytes, const InputFolder&) {
  contents_of_pack(bytes, 1000);
}

void read_pack_frame(std::span<const std::byte> bytes, const InputFolder&) {
  unpacked_frame(bytes);
}

const Intrinsics kLens = small_bundle().cameras.cameras[0].intrinsics;
constexpr std::size_t kFaces = 4;

void read_pack_maps(std::span<const std::byte> bytes, const InputFolder&) {
  decoded_maps(bytes, kLens, kFaces, "maps");
}

Bundle with_skin() {
  Bundle bundle = small_bundle();
  bundle.skin = flat_skin(bundle.proxy, 2);
  bundle.base.face_count = 16;
  bundle.base.height_mm.resize(16 * 6), bundle.base.seen_by.resize(16 * 6);
  bundle.base.color.resize(16 * 6, {0, 0, 0});
  return bundle;
}

std::string parts_of(const Bundle& bundle) {
  const TemporaryFolder folder;
  write_bundle(folder.path(), bundle);
  std::vector<std::pair<std::size_t, std::string>> files;
  for (std::size_t i = 0; i < kBundleFiles.size(); ++i)
    if (std::filesystem::exists(folder.path() / kBundleFiles[i]))
      files.emplace_back(i, read_text_file(folder.path() / kBundleFiles[i]));
  return joined_parts(files);
}

std::string as_text(const std::vector<std::byte>& bytes) { return text_of(bytes); }

Seeds pack_contents_seeds() {
  const std::size_t contents = pack_contents_bytes(2);
  const auto rest = static_cast<std::uint32_t>(1000 - contents);
  return {as_text(pack_contents({{0, 100, 1000}, {0, rest - 100, 2000}}))};
}

Seeds pack_frame_seeds() {
  return {as_text(packed_frame(small_bundle())), as_text(packed_frame(with_skin()))};
}

Seeds pack_map_seeds() { return {as_text(coded_maps(small_bundle().maps[0], kLens))}; }

const Words kParts = {
    kPartMark,     "\"width\": ", "\"fx\": ", "\"springs\": ", "element face ", "dataWindow",
    "compression", "channels",    "Y",        "face",          "confidence"};

}  // namespace

Seeds bundle_seeds() { return {parts_of(small_bundle()), parts_of(with_skin())}; }

std::vector<FuzzReader> bundle_readers() {
  return {
      {"bundle", read_bundle, bundle_seeds, kParts, 600},
      {"reseal", reseal_bundle, bundle_seeds, kParts, 240},
      {"pack-contents", read_pack_contents, pack_contents_seeds, {}, 6000},
      {"pack-frame", read_pack_frame, pack_frame_seeds, {"\"width\": ", "\"springs\": "}, 3200},
      {"pack-maps", read_pack_maps, pack_map_seeds, {}, 6000},
  };
}

}  // namespace organbake
