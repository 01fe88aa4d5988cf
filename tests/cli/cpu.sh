#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# On a processor without AVX2 the programs say so, instead of dying of an illegal instruction.
source "$(dirname "$0")/assert.sh"
if ! command -v qemu-x86_64 >/dev/null; then
  echo "SKIPPED: no qemu-x86_64 (package qemu-user) to play an old processor"
  exit 0
fi
for program in organbake organplay; do
  [ -x "$BIN/$program" ] || continue
  expect 70 qemu-x86_64 -cpu Nehalem "$BIN/$program" --version
  expect_err "$program: this processor is too old: AVX2"
  expect 0 qemu-x86_64 -cpu Haswell "$BIN/$program" --version
done
