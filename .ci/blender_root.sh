#!/usr/bin/env bash
# Make, or find in the cache, a Debian sid root that holds Blender and a software-GL X server.
#
#   .ci/blender_root.sh          # the last line on stdout is the path of the root
#
# Why a root of another Debian: the bpy wheels have no window, and the Debian release CI runs on
# has a Blender too old for this extension; sid's is a current one. Nothing of it is installed into
# the machine itself.
#
# Exit codes: 0 the root is there, 3 this machine may not make one (one line on stderr says what to
# run), anything else: a step failed.
#
# Variables:
#   ACCELSCOPE_CACHE          cache directory (default: accelscope in the user's cache directory)
#   ACCELSCOPE_DEBIAN_MIRROR  Debian mirror (default: the first one in the machine's apt sources)
set -euo pipefail

# Raise this when the way the root is made changes; a cached root made another way is replaced.
readonly RECIPE=2

# python3-cattr and python3-requests: without them Blender's extension system does not register.
# python3-numpy: bpy itself and the extension import it. x11-utils: xwininfo, to see what is shown.
readonly PACKAGES=(
  blender
  imagemagick
  libgl1-mesa-dri
  python3-cattr
  python3-numpy
  python3-requests
  python3-zstandard
  x11-utils
  xdotool
  xvfb
)

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
# debootstrap and chroot stand in a folder that is not on everybody's PATH, not even on root's.
PATH=$PATH:/usr/sbin:/sbin
cache=${ACCELSCOPE_CACHE:-${XDG_CACHE_HOME:-${HOME:?}/.cache}/accelscope}
root=$cache/blender-root
partial=$root.partial
stamp=$root/.accelscope-stamp
recipe="recipe $RECIPE: ${PACKAGES[*]}"

say() { printf 'blender_root: %s\n' "$*"; }

cannot() {
  printf 'blender_root: %s\n' "$*" >&2
  exit 3
}

found() {
  [[ -f $stamp && $(head -n 1 "$stamp") == "$recipe" ]]
}

finish() {
  say "$(sed -n 2p "$stamp")"
  printf '%s\n' "$root"
  exit 0
}

if found; then
  say "found in the cache"
  finish
fi

again="sudo env ACCELSCOPE_CACHE='$cache' '$0'"
[[ $(id -u) == 0 ]] || cannot "making the root needs root rights: run $again"
command -v apt-get >/dev/null || cannot "no apt-get: on a Debian machine run $again"
[[ -f /etc/debian_version ]] || cannot "not a Debian machine: on one run $again"
unshare --mount --pid --fork true 2>/dev/null ||
  cannot "this container forbids mounts: where they are allowed (docker run --privileged) run $0"

mkdir -p "$cache"
exec 9>"$cache/blender-root.lock"
flock 9
if found; then
  say "another process has just made it"
  finish
fi

command -v debootstrap >/dev/null || "$here/apt.sh" debootstrap || cannot \
  "debootstrap is missing: run apt-get update && apt-get install debootstrap"

# The mirror this machine itself uses, so that no host name stands in the project: apt is asked, as
# it reads both formats of its sources (and answers this before the first `apt-get update`). The
# suite named like the release is the main archive; the security archive has no sid.
mirror=${ACCELSCOPE_DEBIAN_MIRROR:-$(
  codename=$(sed -n 's/^VERSION_CODENAME=//p' /etc/os-release)
  apt-get --print-uris update |
    sed -n "s|^'\\(.*\\)/dists/$codename/InRelease'.*|\\1|p" | head -n 1 || true
)}
[[ -n $mirror ]] || cannot "no Debian mirror in apt's sources: run ACCELSCOPE_DEBIAN_MIRROR=URL $0"

# What was interrupted is thrown away. Its mounts were private to the process that made them and
# ended with it; --one-file-system is a second belt.
rm -rf --one-file-system "$partial" "$root.old"
mkdir -p "$partial"
started=$SECONDS
say "making $root from the suite sid of this machine's mirror (one to three minutes)"

# The host's way to the mirror (proxies, certificates, clock checks) is needed inside as well, but
# only while packages are installed: it is read through APT_CONFIG and removed with $setup.
setup=$partial/setup
mkdir "$setup"
apt-config dump | grep -E '^Acquire::(Check-|https?::|ftp::|Retries|ForceIPv|Languages)' \
  >"$setup/apt.conf" || true
if [[ $mirror == https:* && -f /etc/ssl/certs/ca-certificates.crt ]]; then
  cp -L /etc/ssl/certs/ca-certificates.crt "$setup/ca.crt"
  echo 'Acquire::https::CaInfo "/setup/ca.crt";' >>"$setup/apt.conf"
fi
printf '%s\n' "${PACKAGES[@]}" >"$setup/packages"

# Runs as the first process of its own process and mount namespaces: when it ends, in whatever
# way, all it started and mounted is gone.
cat >"$setup/inside.sh" <<'INSIDE'
set -euo pipefail
partial=$1 mirror=$2
say() { printf 'blender_root: %s\n' "$*"; }
mount -t proc proc /proc
debootstrap --variant=minbase sid "$partial" "$mirror" >"$partial/setup/log" 2>&1
say "base system ready after $SECONDS s, installing Blender"
cp -L /etc/resolv.conf "$partial/etc/resolv.conf"
# Translations and documentation are a tenth of the root, and nobody reads them here.
cat >"$partial/etc/dpkg/dpkg.cfg.d/accelscope" <<'CFG'
path-exclude=/usr/share/doc/*
path-exclude=/usr/share/man/*
path-exclude=/usr/share/locale/*
path-exclude=/usr/share/info/*
CFG
for there in proc sys dev; do
  mountpoint -q "$partial/$there" || mount --rbind "/$there" "$partial/$there"
done
export APT_CONFIG=/setup/apt.conf DEBIAN_FRONTEND=noninteractive LC_ALL=C
mapfile -t packages <"$partial/setup/packages"
{
  chroot "$partial" apt-get update
  chroot "$partial" apt-get install -y --no-install-recommends "${packages[@]}"
  chroot "$partial" apt-get clean
} >>"$partial/setup/log" 2>&1
rm -rf "$partial"/var/lib/apt/lists/*
chroot "$partial" blender --version | head -n 1 >"$partial/setup/version"
INSIDE

# Its own pid is kept so that Ctrl-C ends the build: unshare itself ignores that signal.
unshare --mount --pid --fork --kill-child bash "$setup/inside.sh" "$partial" "$mirror" &
builder=$!
trap 'kill -KILL "$builder" 2>/dev/null || true' EXIT
trap 'exit 130' INT TERM
if ! wait "$builder"; then
  tail -n 30 "$setup/log" >&2
  say "making the root failed, the last lines of its log are above" >&2
  exit 1
fi
trap - EXIT INT TERM

version=$(<"$setup/version")
rm -rf --one-file-system "$setup"
# Blender asks this file for the mounted file systems.
ln -sf /proc/self/mounts "$partial/etc/mtab"
# Where .ci/blender_window.sh mounts things; the root itself is read-only then.
mkdir "$partial/accelscope" "$partial/script" "$partial/output" "$partial/wheels"
printf '%s\n%s, made on %s in %s s, %s\n' "$recipe" "$version" "$(date -u +%F)" \
  "$((SECONDS - started))" "$(du -shx "$partial" | cut -f 1)B" >"$partial/.accelscope-stamp"
[[ ! -e $root ]] || mv "$root" "$root.old"
mv "$partial" "$root"
rm -rf --one-file-system "$root.old"
finish
