// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/job_script.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

#include "documents/embedded_files.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

using Json = nlohmann::json;

// Of pipelines/cluster/.
std::string cluster_file(std::string_view name) {
  for (const EmbeddedFile& file : embedded_files()) {
    if (file.name == name) return std::string(file.text);
  }
  throw std::logic_error("no embedded file of this name");
}

std::string shell_words(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + shell_word(word);
  return text;
}

// Of a task, without what tells it from the others.
std::vector<std::string> batch_arguments(const JobPlan& plan) {
  std::vector<std::string> words = {(plan.output / "cases.csv").string()};
  words.insert(words.end(), plan.arguments.begin(), plan.arguments.end());
  words.insert(words.end(), {"-o", plan.output.string()});
  return words;
}

std::string whole(double value) { return std::to_string(std::llround(std::ceil(value))); }

}  // namespace

std::string shell_word(const std::string& text) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789/._-+:,@";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

std::string job_lines(const JobPlan& plan) {
  std::string start =
      shell_word(plan.program.string()) + " batch " + shell_words(batch_arguments(plan));
  if (plan.threads > 0) start += " --threads " + std::to_string(plan.threads);
  const std::string count = std::to_string(plan.tasks);
  std::string text;
  for (std::size_t i = 1; i <= plan.tasks; ++i) {
    text += start + " --shard " + std::to_string(i) + "/" + count + "\n";
  }
  return text;
}

std::string job_snakefile(const JobPlan& plan) {
  const Json config = {{"program", plan.program.string()},
                       {"arguments", plan.arguments},
                       {"output", plan.output.string()},
                       {"tasks", plan.tasks},
                       {"threads", plan.threads},
                       {"memory_mb", std::llround(std::ceil(plan.memory_mb))},
                       {"minutes", std::llround(std::ceil(plan.minutes))}};
  try {  // What JSON has of strings, numbers and lists is Python as well.
    return "config.update(" + config.dump(4) + ")\n\n" + cluster_file("Snakefile");
  } catch (const Json::exception&) {
    throw UsageError("a path is no UTF-8 text, which a Snakefile must be; rename it");
  }
}

std::string job_array(const JobPlan& plan) {
  const std::string script = cluster_file("array.sbatch");
  const std::size_t first_line = script.find('\n') + 1, body = script.find("\n\n") + 1;
  const std::string count = std::to_string(plan.tasks);
  return script.substr(0, first_line) + "#SBATCH --array=1-" + count +
         "\n#SBATCH --cpus-per-task=" + std::to_string(plan.threads) +
         "\n#SBATCH --mem=" + whole(plan.memory_mb) + "M\n#SBATCH --time=" + whole(plan.minutes) +
         "\n" + script.substr(first_line, body - first_line) +
         "\nprogram=" + shell_word(plan.program.string()) + " tasks=" + count + "\nset -- " +
         shell_words(batch_arguments(plan)) + script.substr(body);
}

}  // namespace organbake
