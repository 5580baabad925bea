"""The figures of k-DOP trees report their progress, and can be cancelled."""

import pytest
from accelscope.core.evaluation.records.experiment import Built, make_record
from accelscope.core.progress import Cancelled, Progress


class Stop(Progress):
    def report(self, done, total, text):
        if text == "Measuring volumes":
            raise Cancelled


@pytest.mark.parametrize("kind", ["kdop14", "kdop18", "kdop26"])
def test_statistics_can_be_cancelled(build, lab, kind):
    tree = build("bvh", lab.small_scene("soup"), f"volume={kind}")
    with pytest.raises(Cancelled):
        make_record(Built(tree, 0.0), None, Stop())
    assert make_record(Built(tree, 0.0), None)["statistics"]["sah"] > 0
