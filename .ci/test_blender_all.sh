#!/bin/sh
# Run the Blender tests against every supported version of Blender, each in an environment of its
# own (1 GB each). A version whose Python is not on this machine is left out, named, and a failure:
# it was to be tested.
#
# Run in the root of the checkout: make test-blender-all
unset PYTHON # one interpreter cannot serve all the versions
tested=
failed=
left_out=
while read -r blender next python; do
    printf '\n==> Blender %s (Python %s)\n' "$blender" "$python"
    if ! .ci/find_python.sh "$python" >/dev/null; then
        left_out="$left_out $blender"
        echo "Left out: there is no Python $python that runs here"
        continue
    fi
    folder=.venv-blender-$blender
    .ci/venv.sh "$folder" "$python" --editable ".[extension,test]" \
        "bpy>=$blender,<$next" </dev/null || exit 1
    # A handler left behind makes Blender 4.5 hang when Python exits.
    if timeout 1800 "$folder/bin/pytest" -m "bpy and not exhaustive" </dev/null; then
        tested="$tested $blender"
    else
        failed="$failed $blender"
    fi
done <<LIST
4.5 4.6 3.11
5.0 5.1 3.11
5.1 5.2 3.13
5.2 5.3 3.13
LIST

echo
echo "Blender versions passed:  ${tested:- none}"
echo "Blender versions failed:  ${failed:- none}"
echo "Blender versions left out:${left_out:- none}"
[ -z "$failed$left_out" ]
