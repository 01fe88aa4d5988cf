// SPDX-License-Identifier: GPL-3.0-or-later
// The cases of a batch: named by files, patterns and folders, found in a patient's folder, or cut
// out of long videos at their best spans.
#include "organbake/pipelines/batch_run.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/cache.h"
#include "organbake/pipelines/processes.h"
#include "organbake/pipelines/recipe.h"
#include "recipe_inputs.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// "scan.nii.gz" → "scan"; a folder's name has no ending, though it may hold points (a DICOM UID).
fs::path without_ending(const fs::path& path) {
  if (fs::is_directory(path)) return path;
  const fs::path bare = path.extension() == ".gz" || path.extension() == ".bz2"
                            ? path.parent_path() / path.stem()
                            : path;
  return bare.parent_path() / bare.stem();
}

std::string name_of_file(const fs::path& file) {
  const fs::path normal = file.lexically_normal();
  const fs::path named = normal.has_filename() ? normal : normal.parent_path();
  return without_ending(named).filename().string();
}

std::string name_of_match(const fs::path& file, const fs::path& folder) {
  std::string name = without_ending(file).lexically_relative(folder).generic_string();
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

struct NamedFile {
  std::string name;
  fs::path path;
};

std::vector<NamedFile> named_files(const std::vector<std::string>& words) {
  std::vector<NamedFile> files;
  for (const std::string& word : words) {
    if (!is_file_pattern(word)) {
      files.push_back({name_of_file(word), word});
      continue;
    }
    const fs::path folder = folder_of_pattern(word);
    for (const fs::path& file : files_matching(word)) {
      files.push_back({name_of_match(file, folder), file});
    }
  }
  return files;
}

void check_input_name(const std::string& input) {
  if (is_recipe_input(input)) return;
  throw UsageError("--as " + input + " is no input of a recipe; the inputs are " +
                   joined(recipe_inputs(), ", ", [](const RecipeInput& one) { return one.name; }));
}

}  // namespace

std::string flaw_of_case_name(const std::string& name) {
  if (name.empty()) return "is empty";
  if (name.front() == '.' || name.front() == '-') return "begins with '.' or '-'";
  constexpr std::size_t kLongest = 200;
  if (name.size() > kLongest) return "is longer than 200 bytes";
  for (const unsigned char c : name) {
    if (c == '/') return "holds a '/'";
    if (c < 0x20 || c == 0x7F) return "holds a control character";
  }
  // What the batch itself writes beside its cases.
  for (const char* own :
       {"logs", "pictures", "cases.csv", "batch.json", "batch.csv", "batch.html"}) {
    if (name == own) return "is a name that the batch needs for itself";
  }
  return {};
}

std::vector<BatchCase> cases_of_words(const std::vector<std::string>& words,
                                      const std::string& input) {
  if (words.size() == 1 && is_table_name(words[0])) return read_case_table(words[0]);
  if (words.size() == 1 && lower_ending(words[0]).starts_with(".xls"))
    throw UsageError(words[0] + " is a workbook; save its sheet as CSV (.csv) and give that");
  check_input_name(input);
  std::vector<BatchCase> cases;
  std::set<std::string> names;
  for (const NamedFile& file : named_files(words)) {
    const std::string flaw = flaw_of_case_name(file.name);
    if (!flaw.empty()) {
      throw UsageError(file.path.string() + ": its name '" + file.name + "' " + flaw +
                       "; use a table of cases");
    }
    if (!names.insert(file.name).second) {
      throw UsageError(file.path.string() + ": another file is called '" + file.name +
                       "', too; use a table that names the cases");
    }
    cases.push_back({file.name, {input + "=" + file.path.string()}});
  }
  return cases;
}

Shard parse_shard(const std::string& text) {
  Shard shard;
  int end = 0;
  const int fields = std::sscanf(text.c_str(), "%zu/%zu%n", &shard.index, &shard.count, &end);
  constexpr std::size_t kMost = 1'000'000;
  if (fields != 2 || end != static_cast<int>(text.size()) || shard.index < 1 ||
      shard.index > shard.count || shard.count > kMost) {
    throw UsageError("--shard " + text + " is no shard; write I/N with 1 ≤ I ≤ N, for example 2/8");
  }
  return shard;
}

std::vector<BatchCase> cases_of_shard(const std::vector<BatchCase>& cases, const Shard& shard) {
  std::vector<BatchCase> mine;
  for (std::size_t i = shard.index - 1; i < cases.size(); i += shard.count) {
    mine.push_back(cases[i]);
  }
  return mine;
}

namespace {

constexpr int kDeepest = 3;

std::vector<fs::path> sorted_entries(const fs::path& folder) {
  std::vector<fs::path> entries;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (!entry.path().filename().string().starts_with(".")) entries.push_back(entry.path());
  std::sort(entries.begin(), entries.end());
  return entries;
}

// One series, or several: which one is to be baked the reader asks.
bool holds_slices(const std::vector<fs::path>& entries) {
  return std::any_of(entries.begin(), entries.end(), [](const fs::path& entry) {
    return fs::is_regular_file(entry) && has_dicom_mark(entry);
  });
}

void look_into(const fs::path& folder, int depth, std::vector<FoundInput>& found) {
  const std::vector<fs::path> entries = sorted_entries(folder);
  if (fs::exists(folder / "manifest.json")) return;  // a bundle
  if (holds_slices(entries)) return found.push_back({"ct", folder});
  if (holds_frames(folder)) return found.push_back({"frames", folder});
  for (const fs::path& entry : entries) {
    if (fs::is_directory(entry)) {
      if (depth < kDeepest) look_into(entry, depth + 1, found);
    } else if (const std::string input = given_input(entry).input; !input.empty()) {
      found.push_back({input, entry});
    }
  }
}

}  // namespace

std::vector<FoundInput> inputs_in(const fs::path& folder) {
  if (!fs::exists(folder)) throw NoInputError(folder, "there is no such file or folder");
  std::vector<FoundInput> found;
  if (fs::is_directory(folder)) {
    look_into(folder, 0, found);
  } else if (const std::string input = given_input(folder).input; !input.empty()) {
    found.push_back({input, folder});
  }
  if (found.empty())
    throw NoInputError(folder,
                       "holds no scan, clip or surface that organbake knows; name the folder of a "
                       "patient's DICOM slices, NIfTI files, videos or meshes");
  return found;
}

namespace {

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
    const std::string begin = to_text(span.begin_s, 3);
    const std::string length = to_text(span.end_s - span.begin_s, 3);
    const std::string input = "file:" + fs::absolute(video).string();
    const std::vector<std::string> command = {"/usr/bin/env", "ffmpeg",    "-loglevel",
                                              "error",        "-nostdin",  "-y",
                                              "-ss",          begin,       "-protocol_whitelist",
                                              "file",         "-i",        input,
                                              "-t",           length,      "-map",
                                              "0:v:0",        "-c",        "copy",
                                              "-fflags",      "+bitexact", unfinished};
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
