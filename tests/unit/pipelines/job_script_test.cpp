// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/job_script.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "organbake/core/error.h"

namespace organbake {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

// What a shell makes of a word.
std::string as_shell_reads(const std::string& word) {
  FILE* shell = ::popen(("printf %s " + word).c_str(), "r");
  std::string text;
  for (int c = 0; (c = std::fgetc(shell)) != EOF;) text += static_cast<char>(c);
  EXPECT_EQ(::pclose(shell), 0) << word;
  return text;
}

TEST(ShellWord, IsReadAsItWas) {
  for (const char* text : {"plain/path-1.2_3", "two words", "it's", "\"$HOME\" `id` $(id)", "*?[a]",
                           "a;b|c&d<e>f", "ümlaut", "\\n\\", "~", "#", "", "!x", "{a,b}", "a=b"}) {
    EXPECT_EQ(as_shell_reads(shell_word(text)), text);
  }
}

TEST(ShellWord, StaysPlainWhenItCan) { EXPECT_EQ(shell_word("/a/b-1.csv"), "/a/b-1.csv"); }

JobPlan plan() {
  return {.program = "/opt/organ bake/organbake",
          .output = "/data/it's \"out\" {1}",
          .arguments = {"--recipe", "/r.yaml", "--set", "label=5"},
          .tasks = 3,
          .threads = 2,
          .memory_mb = 1499.5,
          .minutes = 12.1};
}

TEST(JobLines, AreOneCommandForEachTask) {
  const std::string lines = job_lines(plan());
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 3);
  EXPECT_THAT(lines, StartsWith("'/opt/organ bake/organbake' batch '/data/it'\\''s \"out\" {1}/"
                                "cases.csv' --recipe /r.yaml --set 'label=5' -o "));
  EXPECT_THAT(lines, HasSubstr("--threads 2 --shard 3/3\n"));
}

TEST(JobArray, AsksForWhatIsNeededBeforeItsFirstCommand) {
  const std::string script = job_array(plan());
  EXPECT_THAT(script, StartsWith("#!/bin/bash\n"));
  const std::size_t first_command = script.find("\nprogram=");
  for (const char* line : {"#SBATCH --array=1-3\n", "#SBATCH --mem=1500M\n", "#SBATCH --time=13\n",
                           "#SBATCH --cpus-per-task=2\n", "#SBATCH --requeue\n"}) {
    EXPECT_LT(script.find(line), first_command) << line;
  }
}

TEST(JobSnakefile, HoldsItsConfigurationAsJson) {
  const std::string text = job_snakefile(plan());
  const std::string head = "config.update(";
  ASSERT_THAT(text, StartsWith(head));
  const auto config =
      nlohmann::json::parse(text.substr(head.size(), text.find(")\n\n") - head.size()));
  EXPECT_EQ(config["output"], plan().output.string());
  EXPECT_EQ(config["memory_mb"], 1500);
  EXPECT_EQ(config["tasks"], 3);
}

TEST(JobSnakefile, RefusesWhatIsNoUtf8) {
  JobPlan odd = plan();
  odd.output = "/data/\xff";
  EXPECT_THROW(job_snakefile(odd), UsageError);
}

}  // namespace
}  // namespace organbake
