#!/bin/sh
# Install Debian packages where that is allowed, else print the one command that does it.
#
#   .ci/apt.sh PACKAGE ...
command="apt-get install --yes --no-install-recommends $*"
if ! command -v apt-get >/dev/null; then
    echo "Please install what Debian calls: $*" >&2
    exit 1
elif [ "$(id -u)" = 0 ]; then
    as_root=
elif sudo -n true 2>/dev/null; then
    as_root="sudo -n"
else
    echo "Please run this once: sudo apt-get update && sudo $command" >&2
    exit 1
fi
echo "Installing with apt: $*"
export DEBIAN_FRONTEND=noninteractive
# The package lists of a fresh machine are empty or stale, so they are renewed first. One source of
# several that cannot be reached is no reason to give up, nor is another apt at work.
wait="-o DPkg::Lock::Timeout=300 -o Acquire::Retries=3"
log=$({ $as_root apt-get $wait update || true; $as_root $command $wait; } 2>&1) || {
    printf '%s\n' "$log" >&2
    exit 1
}
