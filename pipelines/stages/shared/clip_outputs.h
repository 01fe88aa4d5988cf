// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/image/channel_image.h"
#include "organbake/pipelines/stage.h"
#include "organbake/shading/frame_depth.h"

namespace organbake {

// What the report keeps of a frame.
struct FrameRecord {
  std::size_t index = 0;
  double sharpness = 0;
  bool warm = false, combed = false, metric = false;
  bool colourless = false;
  StereoLayout stereo = StereoLayout::none;
  double residual = 0, median_depth = 0, mean_confidence = 0;
  double outside_share = 0, highlight_share = 0, instrument_share = 0;
  DepthQuality quality;
};
FrameRecord record_of(std::size_t index, double sharpness, const PreparedFrame& frame,
                      const FrameDepth& depth);

// The frame that becomes a surface.
struct KeyFrame {
  FrameRecord record;
  PreparedFrame frame;
  std::shared_ptr<const FrameDepth> depth;
};

// Whether a frame becomes the surface in the place of the one so far: it says more of one.
bool becomes_key(const FrameRecord& record, const std::optional<KeyFrame>& key);

// The folders that write_frame() writes to.
void make_frame_folders(const std::filesystem::path& folder);
// A frame of a clip, as what is written of it has it.
struct WrittenFrame {
  std::string name;
  bool assumed_lens = false;         // its field of view was not measured
  RigidTransform camera_from_scope;  // how the frame's camera was turned against the scope's
};
// depth/, normals/, mask/, confidence/ and pictures/ of one frame, named as it is. The depth map
// says its camera, in the scope's own axes, and whether it is relative (image/exr.h).
void write_frame(const std::filesystem::path& folder, const WrittenFrame& written,
                 const PreparedFrame& frame, const FrameDepth& depth);

// Says where masks hide more than a fifth of the field of view: one that was given may be inverted.
void warn_of_instruments(const std::vector<FrameRecord>& records, bool given,
                         const RunContext& context);

// How many frames are ok, doubtful and failed, into the report; what to say of them when not all
// are ok, else nothing.
std::string count_verdicts(const std::vector<FrameRecord>& records, StageReport& report);

// One figure of each frame as a list in the report.
template <class Record, class Value>
void report_each(StageReport& report, const char* name, const std::vector<Record>& records,
                 const Value& value) {
  std::vector<double> values;
  for (const Record& record : records) values.push_back(static_cast<double>(value(record)));
  report.add(name, values);
}
// The figures that the frames of every clip have, and their verdicts.
void report_frames(const std::vector<FrameRecord>& records, StageReport& report);

// Strips of evenly spaced frames without knowing how many will come: when there are too many, every
// second is dropped and the spacing doubles.
class StripSheet {
 public:
  // Whether the strip of the frame that comes next is wanted; call it once a frame, in order.
  bool wants_next() { return count_++ % spacing_ == 0; }
  void add(Rgb8Image strip);
  // strip.png; nothing without strips.
  void write(const std::filesystem::path& folder) const;

 private:
  std::vector<Rgb8Image> strips_;
  std::size_t count_ = 0, spacing_ = 1;
};

// As the stages' descriptions have it.
inline constexpr const char* kScopePhotoFile = "photo/camera.json";

// The frame's tissue with the scope's light divided out: albedo.png, lighting.json with the light
// that belongs to it, and how much is left in, into the report. Returns the albedo, sRGB.
Rgb8Image write_albedo(const std::filesystem::path& folder, const PreparedFrame& frame,
                       const FrameDepth& depth, const LaparoscopeOptions& lamp, double mm_per_unit,
                       StageReport& report);

// The picture that a surface in camera axes was read from, in its own pixels, with its camera:
// photo/camera.json, which the stages `place` and `capture` take.
void write_scope_photo(const std::filesystem::path& folder, const Rgb8Image& picture,
                       const Intrinsics& camera);

}  // namespace organbake
