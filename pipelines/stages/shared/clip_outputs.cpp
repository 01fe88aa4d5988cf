// SPDX-License-Identifier: GPL-3.0-or-later
// What stages that read clips write of each frame, and what they report of all.
#include "stages/shared/clip_outputs.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/files.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "organbake/image/exr.h"
#include "organbake/image/png.h"
#include "organbake/shading/frame_albedo.h"
#include "organbake/shading/masks.h"
#include "organbake/shading/pictures.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// Rounded to whole steps of 1/n, for the same reason as depth.
float in_steps(float value, float n) { return std::round(value * n) / n; }

// Rounded to one part in 16,384, far below what shading can tell: that halves files and writing.
std::vector<float> rounded(std::vector<float> values) {
  for (float& value : values) {
    auto bits = std::bit_cast<std::uint32_t>(value);
    if (std::isfinite(value)) bits = (bits + 0x100U) & ~0x1FFU;
    value = std::bit_cast<float>(bits);
  }
  return values;
}

ChannelImage depth_channels(const Plane& depth) {
  const std::vector<float> values = rounded(depth.values);
  return {depth.width, depth.height, {{"Y", values}, {"Z", values}}};
}

ChannelImage normal_channels(const FrameDepth& depth) {
  ChannelImage image{depth.depth.width, depth.depth.height, {}};
  for (int c = 0; c < 3; ++c) {
    std::vector<float> values(depth.normals.size());
    for (std::size_t k = 0; k < values.size(); ++k)
      values[k] = std::isfinite(depth.depth.values[k]) ? in_steps(depth.normals[k][c], 128) : 0;
    image.channels.push_back({std::string(1, "XYZ"[c]), std::move(values), true});
  }
  return image;
}

// How much of a surface the frame gives.
double score(const FrameRecord& record) {
  return record.mean_confidence * (1 - record.instrument_share - record.outside_share);
}

}  // namespace

bool becomes_key(const FrameRecord& record, const std::optional<KeyFrame>& key) {
  return !key || score(record) > score(key->record);
}

FrameRecord record_of(std::size_t index, double sharpness, const PreparedFrame& frame,
                      const FrameDepth& depth) {
  FrameRecord record;
  record.index = index;
  record.sharpness = sharpness;
  record.warm = depth.warm;
  record.combed = frame.was_combed;
  record.colourless = frame.colourless;
  record.stereo = frame.stereo;
  record.metric = depth.metric;
  record.residual = depth.residual;
  record.quality = depth.quality;
  record.outside_share = 1 - share_of(frame.field);
  record.highlight_share = share_of(frame.highlights);
  record.instrument_share = share_of(frame.instruments);
  std::vector<float> finite;
  double confidence = 0;
  for (std::size_t k = 0; k < depth.depth.size(); ++k)
    if (std::isfinite(depth.depth.values[k])) {
      finite.push_back(depth.depth.values[k]);
      confidence += depth.confidence.values[k];
    }
  if (finite.empty()) return record;
  record.mean_confidence = confidence / static_cast<double>(finite.size());
  record.median_depth = median(std::move(finite));
  return record;
}

void make_frame_folders(const fs::path& folder) {
  for (const char* part : {"depth", "normals", "mask", "confidence", "pictures"})
    make_folder(folder / part);
}

void write_frame(const fs::path& folder, const WrittenFrame& written, const PreparedFrame& frame,
                 const FrameDepth& depth) {
  const std::string& name = written.name;
  const PosedCamera camera{"laparoscope", frame.camera, written.camera_from_scope};
  ExrWriteOptions options{.zip_level = 1, .camera = camera};
  write_exr(folder / "normals" / (name + ".exr"), normal_channels(depth), options);
  options.notes = {{kWorldNote, kScopesOwnAxes}};
  if (!depth.metric) options.notes[kDepthUnitNote] = kRelativeDepth;
  if (written.assumed_lens) options.notes[kLensNote] = kAssumedLens;
  write_exr(folder / "depth" / (name + ".exr"), depth_channels(depth.depth), options);
  write_png(folder / "pictures" / (name + ".png"), frame.color, 1);
  write_png(folder / "mask" / (name + ".png"), mask_picture(frame), 1);
  Plane confidence = depth.confidence;
  for (float& value : confidence.values) value = in_steps(value, 51);
  write_png(folder / "confidence" / (name + ".png"), grey_picture(confidence), 1);
}

void report_frames(const std::vector<FrameRecord>& records, StageReport& report) {
  const auto list = [&](const char* name, const auto& value) {
    report_each(report, name, records, value);
  };
  list("frame", [](const FrameRecord& r) { return r.index; });
  list("frame_median_depth", [](const FrameRecord& r) { return r.median_depth; });
  list("frame_mean_confidence", [](const FrameRecord& r) { return r.mean_confidence; });
  list("frame_outside_share", [](const FrameRecord& r) { return r.outside_share; });
  list("frame_highlight_share", [](const FrameRecord& r) { return r.highlight_share; });
  list("frame_instrument_share", [](const FrameRecord& r) { return r.instrument_share; });
  std::vector<std::string> verdicts;
  for (const FrameRecord& record : records) verdicts.emplace_back(name_of(record.quality.verdict));
  report.add("frame_verdict", verdicts);
}

void warn_of_instruments(const std::vector<FrameRecord>& records, bool given,
                         const RunContext& context) {
  constexpr double kMuch = 0.2, kNearlyAll = 0.6;
  std::vector<double> of_picture, of_field, highlights;
  for (const FrameRecord& record : records) {
    const double field = std::max(1e-9, 1 - record.outside_share);
    of_picture.push_back(record.instrument_share);
    of_field.push_back((record.instrument_share + record.highlight_share) / field);
    highlights.push_back(record.highlight_share / field);
  }
  const double hidden = median(std::move(of_picture)), masked = median(std::move(of_field));
  if (given) {
    if (hidden > kMuch)
      context.warn(
          "the mask of instruments hides " + percent(hidden) + " of the picture" +
          (hidden > kNearlyAll ? ": is it inverted? It must be black where tissue is" : ""));
  } else if (masked > kMuch) {
    context.warn(percent(masked) +
                 " of the field of view is masked as instruments or highlights (" +
                 percent(median(std::move(highlights))) +
                 " as highlights), where nothing is measured; where that is tissue, give a mask of "
                 "the instruments (shade's --instruments), or take --no-masks");
  }
}

std::string count_verdicts(const std::vector<FrameRecord>& records, StageReport& report) {
  const auto counted = [&](DepthVerdict verdict) {
    return std::count_if(records.begin(), records.end(), [&](const FrameRecord& record) {
      return record.quality.verdict == verdict;
    });
  };
  report.add("frames_ok", counted(DepthVerdict::ok));
  report.add("frames_doubtful", counted(DepthVerdict::doubtful));
  report.add("frames_failed", counted(DepthVerdict::failed));
  const auto worst = std::max_element(records.begin(), records.end(),
                                      [](const FrameRecord& a, const FrameRecord& b) {
                                        return a.quality.verdict < b.quality.verdict;
                                      });
  if (worst->quality.verdict == DepthVerdict::ok) return "";
  if (records.size() == 1)
    return std::string("the frame's depth is judged ") + name_of(worst->quality.verdict) + ": " +
           worst->quality.reason;
  const auto bad = static_cast<std::ptrdiff_t>(records.size()) - counted(DepthVerdict::ok);
  return "of " + std::to_string(records.size()) + " frames " + std::to_string(bad) +
         " have a depth that is judged doubtful or failed (frame " + std::to_string(worst->index) +
         ": " + name_of(worst->quality.verdict) + ": " + worst->quality.reason + ")";
}

void StripSheet::add(Rgb8Image strip) {
  constexpr std::size_t kMostStrips = 12;  // rows of the picture to look at
  strips_.push_back(std::move(strip));
  if (strips_.size() <= kMostStrips) return;
  for (std::size_t i = 1; 2 * i < strips_.size(); ++i) strips_[i] = std::move(strips_[2 * i]);
  strips_.resize((strips_.size() + 1) / 2);
  spacing_ *= 2;
}

void StripSheet::write(const fs::path& folder) const {
  if (!strips_.empty()) write_png(folder / "strip.png", stacked(strips_), 6);
}

Rgb8Image write_albedo(const std::filesystem::path& folder, const PreparedFrame& frame,
                       const FrameDepth& depth, const LaparoscopeOptions& lamp, double mm_per_unit,
                       StageReport& report) {
  FrameAlbedo albedo = divide_light_out(frame, depth, lamp, mm_per_unit);
  write_png(folder / "albedo.png", albedo.color);
  const double known = depth.quality.verdict == DepthVerdict::ok ? 1 : depth.quality.support;
  write_file_atomically(folder / kLightingFile,
                        lighting_to_json(laparoscope_lighting(lamp, known)));
  report.add("albedo_reference_mm", albedo.reference_mm);
  report.add("falloff_in_frame", albedo.falloff_before);
  report.add("falloff_in_albedo", albedo.falloff_left);
  report.add("cosine_in_frame", albedo.cosine_before);
  report.add("cosine_in_albedo", albedo.cosine_left);
  return std::move(albedo.color);
}

void write_scope_photo(const std::filesystem::path& folder, const Rgb8Image& picture,
                       const Intrinsics& camera) {
  const CameraSet set{{{"scope", camera, {}}}, {"picture.png"}, {}};
  make_folder(folder / "photo");
  write_png(folder / "photo/picture.png", picture);
  write_file_atomically(folder / kScopePhotoFile, cameras_to_json(set));
}

}  // namespace organbake
