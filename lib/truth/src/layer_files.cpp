// SPDX-License-Identifier: Apache-2.0
#include "organbake/truth/layer_files.h"

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "organbake/core/files.h"
#include "organbake/image/exr_writer.h"
#include "organbake/image/png.h"

namespace organbake {
namespace {

constexpr int kQuick = 1;  // level: layers are large and many

template <class Value, class Of>
Channel plane(std::string name, std::size_t pixels, Of&& of, bool half = false) {
  std::vector<Value> values(pixels);
  for (std::size_t i = 0; i < pixels; ++i) values[i] = of(i);
  return {std::move(name), std::move(values), half};
}

WriteJob exr_job(const std::filesystem::path& file, int width, int height,
                 std::vector<Channel> channels, ExrCompression compression = ExrCompression::zip) {
  // Shared: a std::function copies what it holds.
  const auto image = std::make_shared<ChannelImage>();
  image->width = width, image->height = height, image->channels = std::move(channels);
  return [file, image, compression] {
    write_exr(file, *image, {.compression = compression, .zip_level = kQuick});
  };
}

std::vector<Channel> id_channels(const PixelTruth& t) {
  const std::size_t n = t.pixels();
  // Tools hide the skin.
  const auto shown = [&](std::size_t i) { return t.solid_at(i) == 0 && t.bound[i].has_skin(); };
  const auto number = [&](std::string name, float BoundPixel::*member) {
    return plane<float>(std::move(name), n,
                        [&](std::size_t i) { return shown(i) ? t.bound[i].*member : 0; });
  };
  const auto organ = [&](std::size_t i) { return shown(i) ? t.organ_at(i) : 0; };
  const auto face = [&](std::size_t i) { return shown(i) ? t.bound[i].face : BoundPixel::kNoSkin; };
  return {plane<std::uint32_t>("organ", n, organ), plane<std::uint32_t>("face", n, face),
          number("b1", &BoundPixel::b1), number("b2", &BoundPixel::b2),
          number("h", &BoundPixel::height_mm)};
}

// Finer than flow is known, and bits that say nothing need not be packed.
float rounded(float px) {
  constexpr float kSteps = 256;
  return std::nearbyint(px * kSteps) / kSteps;
}

// As halves, which are as exact as flow is known up to 50 px or so.
void add_flow(const std::string& name, const Flow* flow, std::vector<Channel>& channels) {
  if (!flow) return;
  const std::size_t n = flow->px.size();
  for (int k = 0; k < 2; ++k)
    channels.push_back(plane<float>(
        name + (k == 0 ? ".x" : ".y"), n, [&](std::size_t i) { return rounded(flow->px[i][k]); },
        true));
  channels.push_back(plane<float>(
      name + ".seen", n, [&](std::size_t i) { return float(flow->seen[i]); }, true));
}

}  // namespace

std::vector<WriteJob> layer_jobs(const std::filesystem::path& folder, const std::string& before,
                                 const std::string& after, const LayerSet& layers,
                                 const PixelTruth& t) {
  const std::size_t n = t.pixels();
  std::vector<WriteJob> jobs;
  const auto exr = [&](const char* layer, std::vector<Channel> channels,
                       ExrCompression compression = ExrCompression::zip) {
    jobs.push_back(exr_job(folder / (before + layer + after + ".exr"), t.width, t.height,
                           std::move(channels), compression));
  };
  // To 16 of a depth's bits: finer than it is known.
  if (layers.depth) exr("depth", {{"Z", t.depth_mm}}, ExrCompression::pxr24);
  if (layers.normals) {
    std::vector<Channel> channels;
    for (int k = 0; k < 3; ++k)
      channels.push_back(plane<float>(
          std::string(1, "XYZ"[k]), n, [&](std::size_t i) { return t.normal[i][k]; }, true));
    exr("normals", std::move(channels));
  }
  if (layers.mask)
    jobs.push_back([file = folder / (before + "mask" + after + ".png"), width = t.width,
                    height = t.height, label = t.label] {
      write_file_atomically(file, encode_grey_png(width, height, std::span(label), kQuick));
    });
  if (layers.id) exr("id", id_channels(t));
  if (layers.weight)
    exr("weight", {plane<float>(
                      "weight", n, [&](std::size_t i) { return t.bound[i].weight; }, true)});
  return jobs;
}

void write_layers(const std::filesystem::path& folder, const std::string& before,
                  const std::string& after, const LayerSet& layers, const PixelTruth& truth) {
  for (const WriteJob& job : layer_jobs(folder, before, after, layers, truth)) job();
}

std::vector<WriteJob> flow_jobs(const std::filesystem::path& file, int width, int height,
                                const Flow* forward, const Flow* backward) {
  std::vector<Channel> channels;
  add_flow("forward", forward, channels);
  add_flow("backward", backward, channels);
  if (channels.empty()) return {};
  return {exr_job(file, width, height, std::move(channels))};
}

}  // namespace organbake
