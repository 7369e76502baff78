"""The errors of a depth camera: each as large as it says, the same again from the same key."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from vinl.config.errors import InputError
from vinl.robot.cameras import Camera
from vinl.sensing.sensor import DepthSensor
from vinl.sensing.sensor_config import SensorConfig, load_sensors

CAMERA = Camera("navigation", (0.0, 0.0, 0.0), 0.0, 1.5, 80, 60, 10.0, "fill")
N = 24


def spoil(config: SensorConfig, depth: float | torch.Tensor, camera: Camera = CAMERA, key: int = 5, at: float = 0.0):
    sensor = DepthSensor(config, camera, N)
    keys = torch.arange(N, dtype=torch.int32) + key
    sensor.restart(torch.arange(N, dtype=torch.int32), torch.ones(N, dtype=torch.bool))
    images = torch.full((N, 60, 80), depth) if isinstance(depth, float) else depth
    rows, position = torch.arange(N, dtype=torch.int32), torch.full((N, 3), at)
    return sensor.spoil(images, rows, keys, position, torch.eye(3).expand(N, 3, 3)), sensor


@pytest.mark.parametrize("depth", [1.0, 2.0, 4.0])
def test_noise_grows_with_the_square_of_the_distance(depth):
    seen, _ = spoil(SensorConfig(noise=0.01), depth)
    assert seen.mean().item() == pytest.approx(depth, rel=0.002)
    assert seen.std().item() == pytest.approx(0.01 * depth**2, rel=0.02)


def test_holes_are_as_many_as_asked_for():
    def missing(depth: float | torch.Tensor = 2.0, **errors) -> float:
        return (spoil(SensorConfig(**errors), depth)[0] == 0).float().mean().item()

    assert missing() == 0.0
    assert missing(pixels=0.05) == pytest.approx(0.05, rel=0.05)
    assert missing(patches=0.04) == pytest.approx(0.04, rel=0.35)
    assert missing(edges=1.0) == 0.0 and missing(range=(0.1, 2.0)) == 1.0 and missing(range=(2.1, 9.0)) == 1.0
    step = torch.full((N, 60, 80), 4.0)
    step[:, :, 40:60] = 2.0  # both columns beside the nearer thing
    assert missing(step, edges=1.0) == pytest.approx(2 / 80)
    assert missing(step, edges=1.0, edge_step=0.6) == 0.0
    assert missing(pixels=0.05, amplitude=(2.0, 2.0)) == pytest.approx(0.1, rel=0.05)


def test_dead_surfaces_stay_where_they_are():
    config = SensorConfig(surfaces=0.3, surface_size=0.5)
    first, second = spoil(config, 3.0)[0] == 0, spoil(config, 3.0, key=99)[0] == 0
    assert torch.equal(first, second) and 0.15 < first.float().mean() < 0.45
    assert not torch.equal(first, spoil(config, 3.0, at=0.7)[0] == 0)
    assert (spoil(config, 10.0)[0] == 10.0).all()  # where nothing is, nothing is dead


def test_the_same_key_gives_the_same_image_in_either_type():
    config = load_sensors("realistic")
    depth = torch.rand(N, 60, 80, generator=torch.Generator().manual_seed(0)) * 8 + 0.5
    seen, sensor = spoil(config, depth)
    assert torch.equal(seen, spoil(config, depth)[0]) and not torch.equal(seen, spoil(config, depth, key=6)[0])
    for name, low, high in (("amplitude", 1, 1), ("scale", 0.99, 1.01), ("delay", 0.02, 0.06)):
        assert ((sensor.drawn[name] >= low - 1e-6) & (sensor.drawn[name] <= high + 1e-6)).all()
    assert sensor.drawn["delay"].unique().numel() == N
    far = replace(CAMERA, missing="as_is")
    assert torch.equal(spoil(config, depth, far)[0] == 10.0, seen == 0)  # as a policy without preparation was trained


def test_an_ideal_camera_leaves_images_alone():
    depth = torch.rand(N, 60, 80)
    assert load_sensors("ideal").is_ideal and spoil(load_sensors("ideal"), depth)[0] is depth


def test_broken_settings_are_named(tmp_path):
    with pytest.raises(InputError, match=r"sensors\.pixels"):
        SensorConfig(pixels=1.5)
    with pytest.raises(InputError, match=r"sensors\.delay"):
        SensorConfig(delay=(0.1, 0.0))
    file = tmp_path / "mine.yaml"
    file.write_text("extends: sensors/realistic\nnoise: 0.02\n")
    assert load_sensors(str(file)) == replace(load_sensors("realistic"), noise=0.02)
    with pytest.raises(InputError, match="unknown config 'sensors/perfect'"):
        load_sensors("perfect")
    assert np.isclose(load_sensors("training").amplitude[1], 2.0)
