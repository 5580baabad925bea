#!/bin/sh
# Make a virtual environment with AccelScope installed editable.
#
#   .ci/venv.sh FOLDER "PYTHON VERSIONS, best first" REQUIREMENT ...
#
# Run in the root of the checkout. An interpreter named by $PYTHON goes before the search.
set -e
folder=$1
versions=$2
shift 2

python=${PYTHON:-$(.ci/find_python.sh $versions)} || {
    echo "No Python found that runs: looked for version $(echo $versions | sed 's/ / and /g')." >&2
    exit 1
}
if [ ! -x "$folder/bin/python" ]; then
    # Debian keeps the venv module in a package of its own.
    if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
        version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
        .ci/apt.sh "python$version-venv"
    fi
    echo "Making $folder with $python"
    "$python" -m venv "$folder"
fi
echo "Installing into $folder (on the first run this downloads Blender as a module, about 400 MB)"
"$folder/bin/python" -m pip install --quiet "$@"
