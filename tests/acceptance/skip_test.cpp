// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "measuring/agreement.h"
#include "measuring/programs.h"
#include "organbake/bundle/bundle.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/files.h"
#include "organbake/core/random.h"
#include "organbake/core/temporary_files.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/volume/read_volume.h"
#include "organbake/volume/volume.h"
#include "promises.h"

// What a scene does not need is left out, and what comes of it is the same to the byte.

namespace organbake {
namespace {

// A CT of noise, 512 × 512 × 300, in a MetaImage that is not packed: of packed voxels all up to the
// last one needed must be unpacked. Throws IoError.
Volume write_noise_ct(const std::filesystem::path& file) {
  Volume ct;
  ct.size = {512, 512, 300};  // of a small one the voxel round a region would be a large share
  ct.spacing_mm = {0.7, 0.7, 1};
  ct.voxels.resize(std::size_t(ct.size[0]) * ct.size[1] * ct.size[2]);
  RandomStream random(1);
  for (std::int16_t& voxel : ct.voxels) voxel = std::int16_t(random.below(1024));
  std::string text =
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nDimSize = 512 512 300\n"
      "ElementSpacing = 0.7 0.7 1\nOffset = 0 0 0\nElementType = MET_SHORT\n"
      "ElementDataFile = LOCAL\n";
  text.append(reinterpret_cast<const char*>(ct.voxels.data()),
              ct.voxels.size() * sizeof(std::int16_t));
  write_file_atomically(file, text);
  return ct;
}

// The world's box round the middle that holds this share of each axis.
Region middle_of(const Volume& ct, const Eigen::Vector3d& share) {
  const Eigen::Vector3d last(ct.size[0] - 1., ct.size[1] - 1., ct.size[2] - 1.);
  const auto corner = [&](double side) -> Eigen::Vector3d {
    return ct.world_from_index((0.5 * (Eigen::Vector3d::Ones() + side * share)).cwiseProduct(last));
  };
  return {corner(-1), corner(1)};
}

namespace fs = std::filesystem;

double files_that_differ(const fs::path& a, const fs::path& b) {
  const auto files = list_files(a);
  if (files != list_files(b)) return double(files.size());
  return double(std::count_if(files.begin(), files.end(), [&](const fs::path& file) {
    return read_text_file(a / file) != read_text_file(b / file);
  }));
}

double stages_run(const nlohmann::ordered_json& bake) {
  double count = 0;
  for (const auto& stage : bake.at("stages")) count += stage.at("state") == "ran";
  return count;
}

struct Skip : testing::Test {
  TemporaryFolder folder;
  Baker baker{folder.path(),
              {},
              organ_recipe("what is skipped",
                           "phantom: {photos: 8, photo_size_px: 512, size_voxels: [128, 128, 64]}\n"
                           "place: {count: 6, size_px: 512}\n")};
  fs::path whole = folder.path() / "whole", skipping = folder.path() / "skipping";
};

TEST_F(Skip, OfStagesGivesTheSameBundle) {
  baker.bake(skipping);
  baker.bake(whole, {"--force"});
  expect({"a recipe baked again: stages run", "", stages_run(baker.bake(skipping)), 0});
  expect({"a recipe baked again: results that differ", "", files_that_differ(whole, skipping), 0});
  const std::vector<std::string> faces = {"--set", "decimate.faces=82"};
  expect({"another number of faces: stages run, of 6", "", stages_run(baker.bake(skipping, faces)),
          3});
  baker.bake(whole, {"--force", faces[0], faces[1]});
  expect(
      {"another number of faces: results that differ", "", files_that_differ(whole, skipping), 0});
}

// Texels that hold a piece of the organ.
double texels_in(const fs::path& bundle) {
  double count = 0;
  for (const CameraMaps& maps : BundleReader(bundle).read_all().maps)
    for (const float depth : maps.depth_mm) count += std::isfinite(depth);
  return count;
}

double cameras_in(const fs::path& bundle) {
  return double(BundleReader(bundle).read_frame().cameras.cameras.size());
}

// A viewer who never leaves a cone of 60°, and one who goes anywhere; each must be shown 99 % of
// what they can ever see by two cameras.
TEST_F(Skip, OfViewsOutsideAConeSavesCameras) {
  const std::vector<std::string> cover = {"--set", "place.coverage=0.99",
                                          "--set", "place.candidates=512",
                                          "--set", "place.samples=2048"};
  std::vector<std::string> inside = cover;
  inside.insert(inside.end(), {"--set", "place.cone_angle_deg=30"});
  baker.bake(whole, cover);
  baker.bake(skipping, inside);
  const auto saved = [](double all, double part) { return 100 * (1 - part / all); };
  using enum Figure::Goal;
  expect({"a viewing cone of 60°: cameras saved", "%",
          saved(cameras_in(whole), cameras_in(skipping)), 40, at_least});
  expect({"a viewing cone of 60°: texels saved", "%", saved(texels_in(whole), texels_in(skipping)),
          40, at_least});
}

// Bytes that this process asked its files for, by whatever library, since it began.
double bytes_read() { return number_behind("rchar:", "/proc/self/io").value_or(0); }

TEST_F(Skip, OfVoxelsGivesTheSameOnes) {
  const fs::path file = folder.path() / "ct.mha";
  const Volume ct = write_noise_ct(file);
  for (const auto& [name, share] :
       {std::pair("slices in the middle", Eigen::Vector3d(1, 1, 0.18)),
        std::pair("a box in the middle", Eigen::Vector3d(0.7, 0.53, 0.45))}) {
    const Region region = middle_of(ct, share);
    const double start = bytes_read();
    const Volume all = read_volume(file);
    const double middle = bytes_read();
    const Volume part = read_volume(file, {.region = region});
    const double end = bytes_read();
    const Volume cut = cropped(all, voxels_of_region(ct, region, name));
    ASSERT_EQ(cut.size, part.size);
    const std::string what = std::string(name) + " of a CT of 512×512×300: ";
    expect({what + "results that differ", "", count_different(cut.voxels, part.voxels), 0});
    expect({what + "bytes read of the file's", "%", 100 * (end - middle) / (middle - start), 25});
  }
}

// Two frames of a camera that stands still: the same scene, other noise.
TEST(SkipOfSweeps, LeavesTheDepth) {
  const LaparoscopyFrame frame = LaparoscopyPhantom({.frames = 2}).frame(0);
  const auto prepared = [&](std::uint64_t noise_seed) {
    return prepare_frame(with_noise(frame.image, 1, noise_seed), frame.camera.intrinsics, {});
  };
  const PreparedFrame first = prepared(1), second = prepared(2);
  const FrameDepth previous = shade_frame(first, {});
  const FrameDepth cold = shade_frame(second, {}), warm = shade_frame(second, {}, &previous);
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < cold.depth.size(); ++k) {
    if (!std::isfinite(cold.depth.values[k]) || !std::isfinite(warm.depth.values[k])) continue;
    sum += std::abs(warm.depth.values[k] / cold.depth.values[k] - 1);
    ++count;
  }
  const std::string what = "a frame of a clip that stands still: ";
  expect({what + "mean difference to the cold start", "%", 100 * sum / count, 0.05});
  expect({what + "sweeps", "", double(warm.range.sweeps), double(cold.range.sweeps)});
  expect({what + "refinements", "", double(warm.refinements), double(cold.refinements)});
}

// Where nothing or one vertex has moved since the last frame.
TEST_F(Skip, OfPixelsGivesTheSameFrame) {
  baker.bake(whole);
  const Bundle bundle = BundleReader(whole).read_all();
  const View view = orbit_view(bundle.cameras, {0.3, 0.1}, 1280, 720);
  Warper warper(bundle), other(bundle);
  Frame last;
  warper.draw(bundle.proxy.vertices, view, {}, last);
  for (int step = 0; step < 4; ++step) {
    std::vector<Eigen::Vector3d> positions = bundle.proxy.vertices;
    positions[0] *= 1 - 0.002 * (step / 2);  // each twice
    Frame anew;
    warper.draw(positions, view, {}, last);
    other.draw(positions, view, {}, anew);
    expect({"frame " + std::to_string(step) + " on the one before: pixels that differ", "",
            count_different(anew.color.pixels, last.color.pixels), 0});
  }
}

}  // namespace

}  // namespace organbake
