#!/usr/bin/env bash
# Install a zip into a Blender nobody has used before, then evaluate a .blend with its command line.
# OUTPUT_DIR/inside.json is all that comes to standard output: JSON, though Blender misses its colour
# profile and says when it quits. What it logs before the command begins, --log-file takes.
#
#   .ci/blender_window.sh tests/window/evaluate.sh OUTPUT_DIR ZIP BLEND ARGUMENT ...
#
# Run by test_window.py. No set -x or the like: what the command prints is looked at.
set -euo pipefail

zip=$1 blend=$2
shift 2
blender --background --command extension install-file --repo user_default --enable "$zip" \
  >/output/install.log
export OCIO=/nowhere/config.ocio
blender --log-file /output/log.txt "$blend" --command accelscope evaluate "$@" --json - \
  >/output/inside.json
