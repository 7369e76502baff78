import pytest

from vinl.sensing.benchmark import run_depth


def test_reports_speed_and_share_of_the_bare_kernel():
    result = run_depth(num_images=4, width=16, height=16, device="cpu", seconds=0.05, homes=2)
    assert result["images_per_s"] > 0 and result["bare_images_per_s"] > 0
    assert result["share"] == pytest.approx(result["images_per_s"] / result["bare_images_per_s"])
    boxes = (result["triangles"] - 2 * 4) / 12 / 2
    assert 70 <= boxes <= 95
