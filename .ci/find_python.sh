#!/bin/sh
# Print the path of the first Python of the given versions that really runs.
#
#   .ci/find_python.sh 3.13 3.11
#
# A name on PATH proves nothing (pyenv's shims exist for versions that are not active), so every
# candidate is run. Pythons that pyenv keeps off PATH are looked at as well.
for version in "$@"; do
    for candidate in "python$version" "python3" \
        "${PYENV_ROOT:-$HOME/.pyenv}"/versions/"$version".*/bin/"python$version"; do
        found=$("$candidate" -c 'import sys; print("%d.%d" % sys.version_info[:2], sys.executable)' \
            2>/dev/null) || continue
        if [ "${found%% *}" = "$version" ]; then
            echo "${found#* }"
            exit 0
        fi
    done
done
exit 1
