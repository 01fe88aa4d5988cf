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
int run_report(const Arguments& arguments, Session& session);
int run_reseal(const Arguments& arguments, Session& session);
int run_verify(const Arguments& arguments, Session& session);
int run_schema(const Arguments& arguments, Session& session);
int run_doctor(const Arguments& arguments, Session& session);
int run_man(const Arguments& arguments, Session& session);
int run_completions(const Arguments& arguments, Session& session);

// The commands that are no stages, in the order in which help lists them.
struct Verb {
  const char* name;
  const char* summary;
  int (*run)(const Arguments&, Session&);
};
std::span<const Verb> all_verbs();

}  // namespace organbake
