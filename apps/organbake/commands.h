// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "organbake/pipelines/stage.h"
#include "session.h"

namespace organbake {

// Each reads its arguments, does its work and returns the exit code; errors are thrown.
int run_stage_command(const Stage& stage, const Arguments& arguments, Session& session);
int run_bake(const Arguments& arguments, Session& session);
int run_batch(const Arguments& arguments, Session& session);
int run_plan(const Arguments& arguments, Session& session);
int run_inspect(const Arguments& arguments, Session& session);
int run_export(const Arguments& arguments, Session& session);
int run_new(const Arguments& arguments, Session& session);
int run_recipes(const Arguments& arguments, Session& session);
int run_materials(const Arguments& arguments, Session& session);
int run_report(const Arguments& arguments, Session& session);
int run_reseal(const Arguments& arguments, Session& session);
int run_verify(const Arguments& arguments, Session& session);
int run_schema(const Arguments& arguments, Session& session);
int run_doctor(const Arguments& arguments, Session& session);
int run_man(const Arguments& arguments, Session& session);
int run_completions(const Arguments& arguments, Session& session);

// What `organbake inspect` tells of a file or folder, read with inspect_options().
StageReport inspect(const std::filesystem::path& path, const StageOptions& reading,
                    Session& session);
std::vector<std::string> material_names();

// The commands that are no stages, in the order in which help lists them.
struct Verb {
  const char* name;
  const char* summary;
  int (*run)(const Arguments&, Session&);
  // What its words can be, for completions; else files.
  std::vector<std::string> (*known_words)() = nullptr;
};
std::span<const Verb> all_verbs();

}  // namespace organbake
