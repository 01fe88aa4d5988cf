// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <memory>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/stage.h"
#include "stages/shared/clip_source.h"
#include "stages/spans/options.h"

namespace organbake {
namespace {

// Pictures that are looked at, the clip's rate, and what its last frame is.
class Scan {
 public:
  Scan(ShadeSource source, const SpansStageOptions& options, const RunContext& context)
      : source_(std::move(source)), options_(options), context_(context), finder_(options.search) {}

  std::vector<ClipSpan> run() {
    constexpr std::size_t kAtOnce = 4;  // pictures in memory
    ClipDriver<Looked>()
        .in_turn([this](Looked& item) { finder_.add(item.frame, item.time_s, item.color); })
        .run(kAtOnce, [this] { return next(); });
    return finder_.take();
  }

  double frames_per_s() const { return frames_per_s_; }
  std::size_t frames() const { return frames_; }
  const std::string& damage() const { return damage_; }

 private:
  struct Looked {
    std::size_t frame;
    double time_s;
    Rgb8Image color;
  };

  std::shared_ptr<Looked> next() {
    StoredPicture picture;
    while (read(picture)) {
      const std::size_t frame = frames_++;
      if (frame == 1) learn_rate(picture.time_s);
      const auto step =
          std::max<std::size_t>(1, std::lround(frames_per_s_ / options_.samples_per_s));
      if (frame == 0) first_s_ = picture.time_s;
      if (frame % step == 0)
        return std::make_shared<Looked>(
            Looked{frame, double(frame) / frames_per_s_, std::move(picture.color)});
    }
    return nullptr;
  }

  bool read(StoredPicture& picture) {
    context_.throw_if_cancelled();
    try {
      return source_.next(picture);
    } catch (const BadDataError& error) {
      if (frames_ == 0) throw;
      damage_ = error.what();
      return false;
    }
  }

  void learn_rate(double second_s) {
    const double rate = 1 / (second_s - first_s_);
    constexpr double kMost = 1000;
    if (rate > 0 && rate < kMost) frames_per_s_ = rate;
  }

  ShadeSource source_;
  const SpansStageOptions& options_;
  const RunContext& context_;
  SpanFinder finder_;
  double frames_per_s_ = 25, first_s_ = std::nan("");  // a folder of frames tells none
  std::size_t frames_ = 0;
  std::string damage_;
};

// The best ones by motion; where there are none, the one that shading can best be made of.
std::vector<bool> chosen_of(const std::vector<ClipSpan>& spans, int best) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < spans.size(); ++i)
    if (spans[i].worth > 0) order.push_back(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return spans[a].worth > spans[b].worth; });
  std::vector<bool> chosen(spans.size(), false);
  for (std::size_t i = 0; i < std::min(order.size(), static_cast<std::size_t>(best)); ++i)
    if (i == 0 || spans[order[i]].worth > SpanFinder::kShadingAlone) chosen[order[i]] = true;
  return chosen;
}

StageReport run(const StageCall& call) {
  const auto options = call.options_as<SpansStageOptions>();
  Scan scan(open_frames(*call.input("frames"), nullptr, call.context), options, call.context);
  const std::vector<ClipSpan> spans = scan.run();
  const std::vector<bool> chosen = chosen_of(spans, options.best);
  StageReport report;
  report.bad_data = scan.damage();
  std::string table = "first_frame,last_frame,begin_s,end_s,worth,chosen,reason\n";
  std::vector<double> begins, ends, picked;
  std::vector<std::string> reasons;
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const ClipSpan& span = spans[i];
    begins.push_back(double(span.first) / scan.frames_per_s());
    ends.push_back(double(span.last + 1) / scan.frames_per_s());
    picked.push_back(chosen[i]);
    reasons.push_back(span.reason);
    table += std::to_string(span.first) + "," + std::to_string(span.last) + "," +
             to_text(begins.back(), 2) + "," + to_text(ends.back(), 2) + "," +
             to_text(span.worth, 3) + "," + (chosen[i] ? "yes" : "no") + ",\"" + span.reason +
             "\"\n";
  }
  write_file_atomically(call.output_folder / "spans.csv", table);
  report.add("frames_read", scan.frames());
  report.add("frames_per_s", scan.frames_per_s());
  report.add("span_begin_s", begins);
  report.add("span_end_s", ends);
  report.add("span_chosen", picked);
  report.add("span_reason", reasons);
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
