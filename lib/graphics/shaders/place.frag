// SPDX-License-Identifier: Apache-2.0
// Of a pass that draws nothing: programs need one.
void main() {}
