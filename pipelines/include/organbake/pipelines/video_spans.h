// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/pipelines/batch_cases.h"
#include "organbake/pipelines/batch_report.h"

namespace organbake {

// The cases of a batch with long videos cut up, and what of those is not baked.
struct SpanCases {
  std::vector<BatchCase> cases;
  std::vector<BatchRow> left_out;  // status "left out", the reason as the error
};

// By a recipe with the section `spans` a long video becomes a case for each of its best spans
// (stage spans), named after the second at which it begins: "gallbladder_0312s". The spans are cut
// out without coding anew, by ffmpeg, into the folder's spans/. Cases that are no long videos, and
// those whose video cannot be read, stay as they are: their own bake tells what is wrong.
// `settings` are of all cases, `cache` as Batch has it. Throws IoError when ffmpeg is missing.
SpanCases cases_of_spans(const std::vector<BatchCase>& cases, const std::filesystem::path& recipe,
                         const std::vector<std::string>& settings,
                         const std::filesystem::path& output, const RunContext& context);

}  // namespace organbake
