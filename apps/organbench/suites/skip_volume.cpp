// SPDX-License-Identifier: GPL-3.0-or-later
#include "error_measures.h"
#include "organbake/core/files.h"
#include "organbake/core/random.h"
#include "organbake/core/text.h"
#include "organbake/volume/read_volume.h"
#include "suites/skip_parts.h"

namespace organbake {
namespace {

// Bytes that this process asked its files for, by whatever library, since it began; 0 where the
// kernel does not tell.
double bytes_read() { return number_behind("rchar:", "/proc/self/io").value_or(0); }

// Not packed: of packed voxels all up to the last one needed must be unpacked.
void write_raw(const std::filesystem::path& file, const Volume& volume) {
  std::string text = "ObjectType = Image\nNDims = 3\nBinaryData = True\nDimSize =";
  for (const int size : volume.size) text += " " + std::to_string(size);
  text += "\nElementSpacing =";
  for (const double spacing : volume.spacing_mm) text += " " + to_text(spacing);
  text += "\nOffset =";
  for (const double offset : volume.origin_mm) text += " " + to_text(offset);
  text += "\nElementType = MET_SHORT\nElementDataFile = LOCAL\n";
  text.append(reinterpret_cast<const char*>(volume.voxels.data()),
              volume.voxels.size() * sizeof(std::int16_t));
  write_file_atomically(file, text);
}

double voxels_that_differ(const Volume& whole, const IndexBox& box, const Volume& part) {
  const Volume cut = cropped(whole, box);
  if (cut.size != part.size) return double(cut.voxels.size());
  return count_different(cut.voxels, part.voxels);
}

// The voxels round the middle: this share of each axis.
void read_region(Bench& bench, const std::filesystem::path& file, const Volume& ct,
                 const std::string& name, const Eigen::Vector3d& share) {
  const Eigen::Vector3d last(ct.size[0] - 1., ct.size[1] - 1., ct.size[2] - 1.);
  const auto corner = [&](double side) -> Eigen::Vector3d {
    return ct.world_from_index((0.5 * (Eigen::Vector3d::Ones() + side * share)).cwiseProduct(last));
  };
  const Region region{corner(-1), corner(1)};
  Volume whole, part;
  const auto bytes_of = [](const std::function<void()>& read) {
    const double before = bytes_read();
    read();
    return bytes_read() - before;
  };
  const auto read_whole = [&] { whole = read_volume(file, bench.context()); };
  const auto read_part = [&] { part = read_volume(file, {.region = region}, bench.context()); };
  const double all_bytes = bytes_of(read_whole), part_bytes = bytes_of(read_part);
  const IndexBox box = voxels_of_region(ct, region, name);
  const std::string what = name + ", " + std::to_string(100 * box.voxels() / ct.voxels.size()) +
                           " % of a CT of " + std::to_string(ct.size[0]) + "×" +
                           std::to_string(ct.size[1]) + "×" + std::to_string(ct.size[2]);
  add_skip_scene(
      bench, {what, read_whole, read_part, [&] { return voxels_that_differ(whole, box, part); }});
  bench.add(Figure{what + ": bytes read of the file's", "%", 100 * part_bytes / all_bytes, 25});
}

}  // namespace

void skip_volume(Bench& bench) {
  Volume ct;
  ct.size = {512, 512, 300};  // of a small one the voxel round the region would be a large share
  ct.spacing_mm = {0.7, 0.7, 1};
  ct.voxels.resize(std::size_t(ct.size[0]) * ct.size[1] * ct.size[2]);
  RandomStream random(1);
  for (std::int16_t& voxel : ct.voxels) voxel = std::int16_t(random.below(1024));
  const std::filesystem::path file = bench.scratch() / "ct.mha";
  write_raw(file, ct);
  read_region(bench, file, ct, "slices in the middle", {1, 1, 0.18});
  read_region(bench, file, ct, "a box in the middle", {0.7, 0.53, 0.45});
}

}  // namespace organbake
