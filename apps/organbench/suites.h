// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace organbake {

class Bench;

void run_isosurface_suite(Bench& bench);
void run_decimate_suite(Bench& bench);
void run_shading_suite(Bench& bench);
void run_motion_suite(Bench& bench);
void run_registration_suite(Bench& bench);
void run_place_suite(Bench& bench);
void run_capture_suite(Bench& bench);
void run_player_suite(Bench& bench);
void run_cutting_suite(Bench& bench);
void run_appearance_suite(Bench& bench);
void run_bake_suite(Bench& bench);
void run_scaling_suite(Bench& bench);
void run_skip_suite(Bench& bench);
void run_stability_suite(Bench& bench);

}  // namespace organbake
