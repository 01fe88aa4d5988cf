// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/video_spans.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/recipe.h"
#include "organbake/pipelines/worker_process.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

struct VideoSpan {
  double begin_s = 0, end_s = 0;
  bool chosen = false;
  std::string reason;
};

// The spans that the stage's report lists.
std::vector<VideoSpan> spans_of(const nlohmann::json& figures) {
  std::vector<VideoSpan> spans;
  for (std::size_t i = 0; i < figures.at("span_begin_s").size(); ++i)
    spans.push_back({figures.at("span_begin_s").at(i), figures.at("span_end_s").at(i),
                     figures.at("span_chosen").at(i) != 0, figures.at("span_reason").at(i)});
  return spans;
}

class Cutting {
 public:
  Cutting(const fs::path& recipe, const std::vector<std::string>& settings, const fs::path& output,
          const RunContext& context)
      : recipe_(recipe), settings_(settings), output_(output), context_(context) {}

  void add(const BatchCase& one) {
    const std::optional<Recipe> recipe = recipe_of(one);
    const fs::path video = recipe ? long_video_of(*recipe) : fs::path();
    if (video.empty()) return result_.cases.push_back(one);
    std::vector<VideoSpan> spans;
    try {
      spans = find_spans(one, *recipe, video);
    } catch (const CancelledError&) {
      throw;
    } catch (const Error& error) {
      context_.warn("no spans are found in " + video.string() + ": " + error.what() +
                    "; the video is baked whole");
      return result_.cases.push_back(one);
    }
    // A clip that is hardly longer than a span is one.
    const double longest_s =
        std::get<double>(recipe->options.at("spans").list.find("longest_s")->get());
    constexpr double kHardly = 1.5;
    if (spans.empty() || spans.back().end_s <= kHardly * longest_s)
      return result_.cases.push_back(one);
    for (const VideoSpan& span : spans) put(one, video, span);
  }

  SpanCases take() { return std::move(result_); }

 private:
  std::optional<Recipe> recipe_of(const BatchCase& one) const {
    std::vector<std::string> settings = settings_;
    settings.insert(settings.end(), one.settings.begin(), one.settings.end());
    try {
      return read_recipe(recipe_, settings);
    } catch (const Error&) {
      return std::nullopt;
    }
  }

  static fs::path long_video_of(const Recipe& recipe) {
    const auto frames = recipe.inputs.find("frames");
    const bool wanted = recipe.sections.contains("spans") && frames != recipe.inputs.end();
    return wanted && fs::is_regular_file(frames->second) ? frames->second : fs::path();
  }

  std::vector<VideoSpan> find_spans(const BatchCase& one, const Recipe& recipe,
                                    const fs::path& video) const {
    context_.info("finding the spans of " + video.string());
    std::vector<std::string> command = {
        (program_folder() / "organbake").string(), "spans",  video.string(), "-o",
        (folder() / (one.name + ".csv")).string(), "--json", "--quiet"};
    for (const Option& option : recipe.options.at("spans").list.all())
      command.insert(command.end(), {option.flag(), option_text(option.get())});
    const fs::path json = log_of(one.name, ".json");
    run_worker(command, json, log_of(one.name, ".log"), context_);
    return spans_of(nlohmann::json::parse(read_text_file(json)).at("report").at("figures"));
  }

  fs::path folder() const {
    make_folder(output_ / "spans");
    return output_ / "spans";
  }

  fs::path log_of(const std::string& name, const std::string& ending) const {
    return output_ / "logs" / (name + ".spans" + ending);
  }

  void put(const BatchCase& one, const fs::path& video, const VideoSpan& span) {
    constexpr std::size_t kDigits = 4;
    const std::string name =
        one.name + "_" + padded(static_cast<std::size_t>(std::lround(span.begin_s)), kDigits) + "s";
    if (!span.chosen) {
      BatchRow row;
      row.name = name;
      row.status = "left out";
      row.error = to_text(span.begin_s, 1) + " to " + to_text(span.end_s, 1) + " s: " + span.reason;
      return result_.left_out.push_back(std::move(row));
    }
    BatchCase cut{name, one.settings};
    cut.settings.push_back("frames=" + cut_out(name, video, span).string());
    result_.cases.push_back(std::move(cut));
  }

  // As it is coded: an edit list hides what lies before the span since its last key frame.
  fs::path cut_out(const std::string& name, const fs::path& video, const VideoSpan& span) const {
    const fs::path file = folder() / (name + ".mp4");
    const fs::path unfinished = folder() / (name + ".part.mp4");
    const std::vector<std::string> command = {"/usr/bin/env",
                                              "ffmpeg",
                                              "-loglevel",
                                              "error",
                                              "-nostdin",
                                              "-y",
                                              "-ss",
                                              to_text(span.begin_s, 3),
                                              "-protocol_whitelist",
                                              "file",
                                              "-i",
                                              "file:" + fs::absolute(video).string(),
                                              "-t",
                                              to_text(span.end_s - span.begin_s, 3),
                                              "-map",
                                              "0:v:0",
                                              "-c",
                                              "copy",
                                              "-fflags",
                                              "+bitexact",
                                              unfinished.string()};
    run_worker(command, "/dev/null", log_of(name, ".log"), context_);
    fs::rename(unfinished, file);
    return file;
  }

  const fs::path& recipe_;
  const std::vector<std::string>& settings_;
  const fs::path& output_;
  const RunContext& context_;
  SpanCases result_;
};

}  // namespace

SpanCases cases_of_spans(const std::vector<BatchCase>& cases, const fs::path& recipe,
                         const std::vector<std::string>& settings, const fs::path& output,
                         const RunContext& context) {
  Cutting cutting(recipe, settings, output, context);
  for (const BatchCase& one : cases) cutting.add(one);
  return cutting.take();
}

}  // namespace organbake
