#!/usr/bin/env bash
# Run a script in a real Blender window, on an X server of its own, inside the root that
# .ci/blender_root.sh makes.
#
#   .ci/blender_window.sh SCRIPT OUTPUT_DIR [BLENDER ARGUMENTS ...] [-- SCRIPT ARGUMENTS ...]
#
# SCRIPT.py is run by Blender (see tests/window/session.py for the harness such scripts use).
# SCRIPT.sh is run by bash instead, on the same X server, and may call `blender` as often as it
# likes: for example to install an extension, and then run its command line.
#
# What the script sees:
#   /accelscope   the checkout, read-only
#   /output       OUTPUT_DIR, writable; Blender's log is OUTPUT_DIR/blender.log
#   /script       the directory of SCRIPT, read-only, when it is not in the checkout
#   /wheels       $ACCELSCOPE_WHEELS, read-only, when that is set
# Arguments that begin with one of those directories' paths out here are rewritten to the paths in
# there. Everything else is read-only, or (/tmp, the home directory, Blender's user resources)
# empty at the start and gone at the end: every run sees a Blender nobody has used before.
#
# Exit codes: Blender's own; 124 if the time was up (OUTPUT_DIR/timeout.png shows the screen then);
# 3 if this machine may not make or use the root (one line on stderr says why).
#
# Variables:
#   ACCELSCOPE_WINDOW_TIMEOUT  seconds until Blender is ended (default: 300)
#   ACCELSCOPE_WHEELS          directory with wheels for the root's Python (default: none)
#   ACCELSCOPE_CACHE           see .ci/blender_root.sh
set -euo pipefail

if (($# < 2)); then
  echo "usage: $0 SCRIPT OUTPUT_DIR [BLENDER ARGUMENTS ...] [-- SCRIPT ARGUMENTS ...]" >&2
  exit 2
fi

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
checkout=$(dirname "$here")
script=$(realpath "$1")
[[ -f $script ]] || { echo "blender_window: no such file: $1" >&2; exit 2; }
mkdir -p "$2"
output=$(realpath "$2")
shift 2
wheels=${ACCELSCOPE_WHEELS:+$(realpath "$ACCELSCOPE_WHEELS")}

root=$("$here/blender_root.sh" | tee >(cat >&2) | tail -n 1)

# Mounting needs root rights, or a user namespace in which the user has them.
namespaces=(--mount --pid --fork --kill-child)
unshare "${namespaces[@]}" true 2>/dev/null || namespaces+=(--map-root-user)
if ! unshare "${namespaces[@]}" true 2>/dev/null; then
  echo "blender_window: this container forbids mounts: run it as root where they are allowed" >&2
  exit 3
fi

# The output comes first: it is often a directory inside the checkout, but is writable.
inside() {
  case $1 in
    "$output" | "$output"/*) printf '/output%s' "${1#"$output"}" ;;
    "$checkout" | "$checkout"/*) printf '/accelscope%s' "${1#"$checkout"}" ;;
    "${wheels:-/dev/null}"/*) printf '/wheels%s' "${1#"$wheels"}" ;;
    *) printf '%s' "$1" ;;
  esac
}

script_directory=
case $script in
  "$checkout"/*) script_inside=$(inside "$script") ;;
  *)
    script_directory=$(dirname "$script")
    script_inside=/script/$(basename "$script")
    ;;
esac

# The script's own arguments, from `--` on, come after --python; Blender's own come before it.
blender_arguments=()
while (($#)) && [[ $1 != -- ]]; do
  blender_arguments+=("$(inside "$1")")
  shift
done
script_arguments=()
for argument in "$@"; do
  script_arguments+=("$(inside "$argument")")
done

case $script in
  *.sh) command=(bash "$script_inside" "${blender_arguments[@]}" "${script_arguments[@]:1}") ;;
  *)
    command=(
      blender --factory-startup --gpu-backend opengl --no-window-focus -p 0 0 1600 1000
      --python-exit-code 1 "${blender_arguments[@]}"
      --python "$script_inside" "${script_arguments[@]}"
    )
    ;;
esac

# Runs as the first process of its own process namespace, with mounts nobody else sees: when it
# ends, in whatever way, all it started and mounted is gone. So nothing out here can ever follow a
# mount into the checkout, and nothing is left to be unmounted.
read -r -d '' mounts <<'INSIDE' || true
set -euo pipefail
root=$1 checkout=$2 output=$3 script_directory=$4 wheels=$5
shift 5
read_only() {
  mount --bind "$1" "$2"
  # Flags that the mount already has may not be dropped in a user namespace: name them again.
  local flags
  flags=$(findmnt -n -o VFS-OPTIONS --target "$2" | tail -n 1)
  mount -o "remount,bind,$flags,ro" "$2"
}
read_only "$root" "$root"
mount -t proc proc "$root/proc"
mount --rbind /sys "$root/sys"
mount --rbind /dev "$root/dev"
for there in tmp run home; do
  mount -t tmpfs -o mode=1777 tmpfs "$root/$there"
done
read_only "$checkout" "$root/accelscope"
mount --bind "$output" "$root/output"
[[ -z $script_directory ]] || read_only "$script_directory" "$root/script"
[[ -z $wheels ]] || read_only "$wheels" "$root/wheels"
exec chroot "$root" "$@"
INSIDE

read -r -d '' session <<'INSIDE' || true
set -uo pipefail
seconds=$1
shift
mkdir /tmp/user /tmp/home
# Xvfb writes the number of the display it found free when it accepts connections.
mkfifo /tmp/display
Xvfb -displayfd 3 -screen 0 1600x1000x24 +extension GLX -nolisten tcp \
  3>/tmp/display >/output/xvfb.log 2>&1 &
if ! read -r -t 30 number </tmp/display; then
  echo "blender_window: Xvfb did not start, see xvfb.log" >&2
  exit 1
fi
export DISPLAY=:$number
cd /output
"$@" >/output/blender.log 2>&1 &
blender=$!
{
  sleep "$seconds"
  timeout -k 1 10 import -window root /output/timeout.png
  touch /tmp/timeout
  kill -KILL "$blender"
} >/dev/null 2>&1 &
wait "$blender"
code=$?
[[ ! -e /tmp/timeout ]] || code=124
exit "$code"
INSIDE

# What an earlier run left must not be taken for this one's.
rm -f "$output"/{blender.log,xvfb.log,timeout.png,passed.txt,failed.txt,failed.png}

seconds=${ACCELSCOPE_WINDOW_TIMEOUT:-300}
# A clean environment: a host's Python or GL variables mean nothing in another Debian. The ones
# for OpenBLAS do: some processors need them for correct results.
environment=(
  env -i
  PATH=/usr/local/bin:/usr/bin:/bin
  LC_ALL=C.UTF-8
  HOME=/tmp/home
  XDG_RUNTIME_DIR=/run
  BLENDER_USER_RESOURCES=/tmp/user
  LIBGL_ALWAYS_SOFTWARE=1
  ACCELSCOPE_OUTPUT=/output
  ${wheels:+ACCELSCOPE_WHEELS=/wheels}
  ${OPENBLAS_CORETYPE:+OPENBLAS_CORETYPE="$OPENBLAS_CORETYPE"}
  ${OPENBLAS_L2_SIZE:+OPENBLAS_L2_SIZE="$OPENBLAS_L2_SIZE"}
)

started=$SECONDS
# In the background, as unshare itself ignores Ctrl-C; killing it ends everything inside.
unshare "${namespaces[@]}" \
  bash -c "$mounts" mounts "$root" "$checkout" "$output" "$script_directory" "$wheels" \
  "${environment[@]}" bash -c "$session" session "$seconds" "${command[@]}" &
running=$!
trap 'kill -KILL "$running" 2>/dev/null || true' EXIT
trap 'exit 130' INT TERM
code=0
wait "$running" || code=$?
trap - EXIT INT TERM

echo "blender_window: exit code $code after $((SECONDS - started)) s, log: $output/blender.log"
((code == 0)) || tail -n 25 "$output/blender.log" >&2 || true
exit "$code"
