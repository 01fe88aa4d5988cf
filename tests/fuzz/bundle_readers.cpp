// SPDX-License-Identifier: GPL-3.0-or-later
// Bundles, packs, scripts and states. What the readers let pass must be playable.

#include "fuzz/readers.h"

#include <cmath>

#include "organbake/bundle/bundle_pack.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/bundle/stored_maps.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/player/player.h"
#include "organbake/player/script.h"
#include "support/meshes.h"
#include "support/organs.h"

namespace organbake {
namespace {

// The files of a bundle of two cameras, as parts of one input (InputFolder::parts). Its manifest is
// made anew each time: who changes a file on purpose seals it as well.
const std::vector<std::string> kBundleFiles = {
    "proxy.ply",         "cameras.json",      "mechanics.json",    "base.exr",
    "skin.exr",          "lighting.json",     "surface.ply",       "cam_000/depth.exr",
    "cam_000/color.exr", "cam_000/micro.exr", "cam_001/depth.exr", "cam_001/color.exr",
    "cam_001/micro.exr"};

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
  const CameraMaps maps = decoded_maps(bytes, kLens, kFaces, "maps");
  for (std::size_t i = 0; i < maps.face.size(); ++i)
    expect_invariant(maps.face[i] == kNoFace || (maps.face[i] < kFaces && maps.depth_mm[i] > 0 &&
                                                 std::isfinite(maps.depth_mm[i])),
                     "a texel on no face or at no depth");
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

Seeds bundle_seeds() { return {parts_of(small_bundle()), parts_of(with_skin())}; }

// What the readers of bundles and scripts let pass must be playable: steps and draws end, tissue
// stays finite, no depth lies behind the eye, and two threads draw what one does.

constexpr int kWidth = 24, kHeight = 18;

// All that was drawn in one go, to be held against another.
using Pictures = std::vector<std::uint8_t>;

void add_sound(const Player& player, const Frame& frame, Pictures& pictures) {
  for (const Eigen::Vector3d& place : player.proxy_positions())
    expect_invariant(place.allFinite(), "a vertex of the tissue is no place");
  for (const float depth : frame.depth_mm)
    expect_invariant(depth >= 0, "a depth is behind the eye");
  expect_invariant(
      frame.color.pixels.size() == std::size_t(3) * frame.color.width * frame.color.height,
      "a picture of another size than it says");
  pictures.insert(pictures.end(), frame.color.pixels.begin(), frame.color.pixels.end());
}

template <class Work>
void expect_same_pictures(const Work& pictures_of) {
  const auto with = [&](int threads) {
    const ThreadLimit limit(threads);
    return pictures_of();
  };
  const Pictures alone = with(1);
  expect_invariant(alone == with(2), "two threads draw other pictures than one");
}

// Poked from outside in, along the way from an eye.
void poke_and_draw(Player& player, const OrbitPose& pose, Pictures& pictures) {
  const View view = orbit_view(player.bundle().cameras, pose, kWidth, kHeight);
  const std::vector<Eigen::Vector3d> rest = player.proxy_positions();
  DrawOptions options;
  options.keep_depth = true;
  Frame frame;
  for (int step = 0; step < 4; ++step) {
    Instrument tip;
    tip.active = true;
    tip.radius_mm = 1;
    const Eigen::Vector3d eye = view.camera.camera_from_world.inverse().translation;
    tip.position_mm = eye + 0.25 * (step + 1) * (rest.front() - eye);
    player.step({tip});
    player.draw(view, options, frame);
    add_sound(player, frame, pictures);
  }
}

void play_bundle(std::span<const std::byte> bytes, const InputFolder& folder) {
  const std::filesystem::path bundle = folder.parts(kBundleFiles, bytes);
  write_manifest(bundle, sealed());
  OrbitPose behind;
  behind.azimuth_rad = 2;
  behind.distance = 0.7;
  expect_same_pictures([&] {
    Pictures pictures;
    Player player(bundle);
    poke_and_draw(player, {}, pictures);
    poke_and_draw(player, behind, pictures);
    return pictures;
  });
}

// With tetrahedra where the script's solver needs them: what cuts does.
Bundle bundle_for(const Script& script) {
  Bundle bundle = small_bundle();
  if (script.solver == TissueSolver::fem) bundle.mechanics.body = small_body();
  return bundle;
}

// A few frames of any script, small, whatever it asks for.
void play_script(std::span<const std::byte> bytes, const InputFolder&) {
  Script script = script_from_json(text_of(bytes), "script.json");
  constexpr int kMostFrames = 4;
  script.frames = std::min(script.frames, kMostFrames);
  if (script.width > kWidth || script.height > kHeight) return;
  PlayOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.draw.keep_depth = true;
  expect_same_pictures([&] {
    Pictures pictures;
    Player player(bundle_for(script));
    if (script.solver) player.set_solver(*script.solver);
    play(player, script, options,
         [&](int, const Frame& frame) { add_sound(player, frame, pictures); });
    return pictures;
  });
}

}  // namespace

std::vector<FuzzReader> bundle_readers() {
  return {
      {"bundle", read_bundle, "bundle", 600, bundle_seeds},
      {"reseal", reseal_bundle, "bundle", 240, bundle_seeds},
      {"pack-contents", read_pack_contents, "", 6000, pack_contents_seeds},
      {"pack-frame", read_pack_frame, "pack-frame", 3200, pack_frame_seeds},
      {"pack-maps", read_pack_maps, "", 6000, pack_map_seeds},
      {"bundle-play", play_bundle, "play", 240, bundle_seeds},
      {"script-play", play_script, "play", 600},
  };
}

}  // namespace organbake
